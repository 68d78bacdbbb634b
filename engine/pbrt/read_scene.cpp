#include "engine/pbrt/read_scene.h"

#include <fmt/format.h>

#include <memory>

#include "engine/pbrt/directives.h"
#include "engine/pbrt/draft.h"
#include "engine/pbrt/state.h"
#include "engine/system/files.h"

namespace lucerna {
namespace {

Job job_of(Draft draft, const SceneOverrides& overrides, const Workers& workers, Monitor& monitor) {
    const FilmSettings film = draft.film;
    const IntegratorSettings integrator = draft.integrator;
    const int spp = draft.spp, passes = draft.passes;
    std::vector<CalculationSurface> surfaces = std::move(draft.surfaces);
    std::vector<std::filesystem::path> files = std::move(draft.files), caches = std::move(draft.caches);
    SceneText world = std::move(draft.world), view = std::move(draft.view);
    Assembled assembled = assemble(std::move(draft), workers, monitor);
    if (overrides.edit) overrides.edit(assembled.parts);
    const Phase phase(monitor, "build scene", 0);
    Scene scene(std::move(assembled.parts), workers);
    warn_of_overlapping_lights(scene, assembled.light_places, workers, monitor);
    return {std::move(scene),
            Camera(assembled.camera),
            film,
            integrator,
            spp,
            {},
            std::move(surfaces),
            std::move(files),
            std::move(caches),
            std::move(world),
            std::move(view),
            passes};
}

}  // namespace

struct SceneFrames::State {
    const SceneOverrides& overrides;
    const Workers& workers;
    Monitor& monitor;
    std::optional<std::filesystem::path> file;  // none: the text is in memory
    std::optional<DirectiveReader> reader;      // none: the text has been read to its end
};

SceneFrames::SceneFrames(const std::filesystem::path& file, const SceneOverrides& overrides,
                         const Workers& workers, Monitor& monitor)
    : state_(new State{overrides, workers, monitor, file, {}}) {
    state_->reader.emplace(read_text(file), file, overrides, monitor);
}

SceneFrames::SceneFrames(std::string text, const std::filesystem::path& pretended_file,
                         const SceneOverrides& overrides, const Workers& workers, Monitor& monitor)
    : state_(new State{overrides, workers, monitor, {}, {}}) {
    state_->reader.emplace(std::move(text), pretended_file, overrides, monitor);
}

SceneFrames::~SceneFrames() = default;

std::optional<Job> SceneFrames::next() {
    if (!state_->reader) return std::nullopt;
    std::optional<Draft> draft = state_->reader->next();
    if (!state_->reader->more()) state_->reader.reset();  // frees the text, which may be long
    if (!draft) return std::nullopt;
    Job job = job_of(std::move(*draft), state_->overrides, state_->workers, state_->monitor);
    if (state_->file) job.files.insert(job.files.begin(), *state_->file);
    return job;
}

bool SceneFrames::more() const {
    return state_->reader.has_value();
}

Draft read_draft(std::string text, const std::filesystem::path& pretended_file,
                 const SceneOverrides& overrides, Monitor& monitor) {
    DirectiveReader reader(std::move(text), pretended_file, overrides, monitor);
    Draft draft = reader.next().value();
    reader.leave_rest();
    return draft;
}

Job read_scene_text(std::string text, const std::filesystem::path& pretended_file,
                    const SceneOverrides& overrides, const Workers& workers, Monitor& monitor) {
    return job_of(read_draft(std::move(text), pretended_file, overrides, monitor), overrides, workers,
                  monitor);
}

Job read_scene(const std::filesystem::path& file, const SceneOverrides& overrides, const Workers& workers,
               Monitor& monitor) {
    Job job = read_scene_text(read_text(file), file, overrides, workers, monitor);
    job.files.insert(job.files.begin(), file);
    return job;
}

namespace {

// Replaces backslashes in names of folders, some of which have become escape sequences.
std::string with_slashes(const std::string& name) {
    constexpr std::string_view control = "\n\t\r\b\f", letter = "ntrbf";
    std::string result;
    for (const char c : name) {
        const std::size_t escape = control.find(c);
        if (escape != control.npos) {
            result += '/';
            result += letter[escape];
        } else {
            result += c == '\\' ? '/' : c;
        }
    }
    return result;
}

}  // namespace

std::filesystem::path Reading::resolve(const std::string& name) {
    const auto in_folder = [&](const std::filesystem::path& file) {
        return file.is_absolute() ? file : folder / file;
    };
    std::filesystem::path file = in_folder(name);
    const std::string other = with_slashes(name);
    std::error_code status;
    if (other != name && !std::filesystem::exists(file, status) &&
        std::filesystem::exists(in_folder(other), status)) {
        warn_or_refuse(place, fmt::format("{}: no such file", printable(file.string())),
                       fmt::format("{} is used", printable(other)));
        file = in_folder(other);
    }
    if (!name.empty()) {
        draft.files.push_back(file);
        if (part) part->files.push_back(file);
    }
    return file;
}

}  // namespace lucerna
