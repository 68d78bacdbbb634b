// Reads and builds the project's own scenes; closed_form/ tests those with a closed form.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "tests/support/scene_text.h"
#include "tests/support/shared_data.h"

namespace lucerna {
namespace scenes_test {

using namespace lucerna::testing;
using ::testing::HasSubstr;

const std::filesystem::path kScenes = std::filesystem::path(LUCERNA_SOURCE_DIR) / "scenes";

std::string text_of(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(in), {});
}

// Returns whether another file of its folder includes it, as a world that several scenes share.
bool is_included(const std::filesystem::path& file) {
    const std::string directive = "Include \"" + file.filename().string() + "\"";
    for (const auto& entry : std::filesystem::directory_iterator(file.parent_path())) {
        if (entry.path().extension() == ".pbrt" && text_of(entry.path()).find(directive) != std::string::npos)
            return true;
    }
    return false;
}

std::vector<std::filesystem::path> main_files() {
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(kScenes)) {
        if (entry.path().extension() != ".pbrt") continue;
        if (text_of(entry.path()).find("WorldBegin") != std::string::npos && !is_included(entry.path()))
            files.push_back(entry.path());
    }
    return files;
}

// Makes meshes and pictures that git does not track by running the scenes' generators where they are missing.
void make_what_is_missing() {
    for (const auto& folder : {kScenes, kScenes / "lamps"}) {
        for (const auto& entry : std::filesystem::directory_iterator(folder)) {
            const std::filesystem::path generator = entry.path() / "make.py";
            if (!std::filesystem::exists(generator) || std::filesystem::exists(entry.path() / "mesh") ||
                std::filesystem::exists(entry.path() / "slide.png")) {
                continue;
            }
            ASSERT_EQ(std::system(("python3 '" + generator.string() + "' > /dev/null").c_str()), 0)
                << generator;
        }
    }
}

// The numbers of lights whose kinds may have units of their own: pbrt's kinds are in W unless the scene
// states a unit, a measured lamp in that of its file.
struct OwnUnits {
    std::size_t measured = 0, others = 0;
};
OwnUnits own_units(const Draft& draft) {
    OwnUnits own;
    for (const DraftLight& light : draft.lights) {
        const auto* area = std::get_if<AreaSpec>(&light.spec);
        const bool measured = std::holds_alternative<PhotometricSpec>(light.spec) ||
                              std::holds_alternative<MeasuredSpec>(light.spec) ||
                              std::holds_alternative<RayFileSpec>(light.spec) || (area && area->lamp);
        ++(measured ? own.measured : own.others);
    }
    return own;
}

// Requires a scene with a measured lamp and another light to state its unit, without reading the lamps'
// files.
void is_of_one_unit(const Draft& draft, const std::filesystem::path& file) {
    if (draft.unit) return;
    const OwnUnits own = own_units(draft);
    EXPECT_TRUE(own.measured == 0 || own.measured + own.others == 1)
        << file << ": may be mixed; Option \"string unit\" is missing";
}

void read_without_a_warning(const std::filesystem::path& file) {
    RecordingMonitor monitor;
    Draft draft;
    ASSERT_NO_THROW(draft = read_draft(text_of(file), file, {}, monitor)) << file;
    EXPECT_TRUE(monitor.warnings.empty()) << file << ": " << monitor.warnings.front();
    EXPECT_FALSE(draft.lights.empty()) << file;
    is_of_one_unit(draft, file);
    EXPECT_TRUE(std::filesystem::exists(file.parent_path() / "README.md")) << file;
}

// Runs in CI only, because the generators take half a minute.
TEST(ScenesWithTheirMeshes, Long_All_AreReadWithoutAWarning) {
    make_what_is_missing();
    const auto files = main_files();
    EXPECT_GE(files.size(), 40U);
    for (const auto& file : files) read_without_a_warning(file);
}

TEST(Scenes, WithoutAGenerator_AreReadWithoutAWarning) {
    std::size_t read = 0;
    for (const auto& file : main_files()) {
        if (std::filesystem::exists(file.parent_path() / "make.py")) continue;
        read_without_a_warning(file);
        ++read;
    }
    EXPECT_GE(read, 25U);
}

TEST(Scenes, MeasuredLampBesideAnotherLight_WithoutAUnit_IsFound) {
    const std::string lamp = "LightSource \"rayfile\" \"string filename\" \"lamp.ray\" ";
    const auto found = [](const std::string& text) {
        const Draft draft = read_file_text(text).draft;
        const OwnUnits own = own_units(draft);
        return std::pair(own.measured, own.others);
    };
    const std::string head(kHead);
    EXPECT_EQ(found(head + lamp + "LightSource \"point\" AreaLightSource \"diffuse\" Shape \"sphere\""),
              std::pair(std::size_t{1}, std::size_t{2}));
    EXPECT_EQ(found(head + "AreaLightSource \"lightfield\" \"string filename\" \"l.exr\" Shape \"sphere\""),
              std::pair(std::size_t{1}, std::size_t{0}));
}

TEST(Scenes, Cornell_HasTheLampsFluxAndFacesIt) {
    Monitor monitor;
    const Job job = read_scene(kScenes / "cornell/cornell.pbrt", {}, {1}, monitor);
    EXPECT_NEAR(job.scene.lights()[0]->power(), 535'434, 5);
    EXPECT_EQ(job.scene.counts().triangles, 32U);
    EXPECT_EQ(job.scene.counts().degenerate_triangles, 0U);
    const auto floor = job.scene.intersect({V3f(V3d(278, 100, 400) - job.scene.origin()), V3f(0, -1, 0)});
    ASSERT_TRUE(floor.has_value());
    EXPECT_NEAR(floor->t, 100, 1e-3);
    EXPECT_GT(floor->at.n.y, 0.999F);
    const auto seen_at = [&](float x) {
        return job.scene.materials()[job.scene.intersect(job.camera.ray({x, 128}, {0.5F, 0.5F}))->material]
            .name;
    };
    EXPECT_EQ(seen_at(8), "red");
    EXPECT_EQ(seen_at(248), "green");
}

TEST(Scenes, OfOtherPeople_AreReadAsTheyStand) {
    LUCERNA_NEED_DATA(path, "pbrt");
    int read = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(path)) {
        if (entry.path().extension() != ".pbrt" ||
            text_of(entry.path()).find("WorldBegin") == std::string::npos)
            continue;
        RecordingMonitor monitor;
        SceneOverrides overrides;
        overrides.skip_missing = true;  // the mesh of one of them is missing
        EXPECT_NO_THROW(
            assemble(read_draft(text_of(entry.path()), entry.path(), overrides, monitor), {2}, monitor))
            << entry.path();
        ++read;
    }
    EXPECT_GE(read, 22);
}

TEST(Scenes, ReferencesScene_IsOurCornell) {
    LUCERNA_NEED_DATA(path, "references/cornell.pbrt");
    Monitor monitor;
    const auto ours = kScenes / "cornell/cornell.pbrt";
    const Draft a = read_draft(text_of(path), path, {}, monitor),
                b = read_draft(text_of(ours), ours, {}, monitor);
    ASSERT_EQ(a.meshes.size(), b.meshes.size());
    for (const DraftMesh& mesh : a.meshes) {  // in any order
        EXPECT_TRUE(std::ranges::any_of(b.meshes, [&](const DraftMesh& other) { return other.p == mesh.p; }));
    }
    EXPECT_EQ(a.camera.world_from_camera, b.camera.world_from_camera);
    EXPECT_EQ(a.camera.fov_degrees, b.camera.fov_degrees);
}

}  // namespace scenes_test
}  // namespace lucerna
