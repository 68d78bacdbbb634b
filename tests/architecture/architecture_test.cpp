// The modules of the project: the includes that each may have, the files that may name each package, and
// conventions for all sources. The test reads the repository's sources; it fails when a dependency is added
// that is not listed here.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace lucerna {
namespace architecture_test {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Each module and the modules it depends on; a module may include itself and everything reachable from it.
const std::map<std::string, std::set<std::string>> kModules{
    {"engine/base", {}},
    {"engine/text", {"engine/base"}},
    {"engine/system", {"engine/text"}},
    {"engine/ranks", {"engine/system"}},
    {"engine/colour", {"engine/system"}},
    {"engine/image", {"engine/colour"}},
    {"engine/pictures", {"engine/image"}},  // no module may include these two: they are loaded at run time
    {"engine/mpi", {"engine/ranks"}},
    {"kdtree", {"engine/ranks"}},
    {"lights", {"engine/image"}},
    {"lights/measurement", {"lights", "engine/ranks"}},  // from a lamp to a light field
    {"engine/scene", {"lights"}},
    {"photon", {"engine/scene", "kdtree"}},
    {"engine/transport", {"engine/scene"}},
    {"engine/guiding", {"engine/transport", "photon"}},
    {"engine/vpl", {"engine/guiding"}},
    {"engine/integrators", {"engine/vpl"}},
    {"engine/denoise", {"engine/image"}},
    {"engine/render", {"engine/integrators", "engine/denoise"}},
    {"engine/render/display", {"engine/image"}},
    {"engine/photometry", {"engine/render"}},
    {"engine/pbrt", {"engine/render"}},
    {"engine/model", {"engine/image"}},
    {"engine/figures", {"engine/image"}},
    {"engine/evaluation", {"engine/pbrt", "engine/figures"}},
    {"engine/cli",
     {"engine/evaluation", "engine/model", "engine/photometry", "engine/render/display",
      "lights/measurement"}},
    {"python/bindings", {"engine/cli"}},
};

// Headers of packages, by prefix, and the only files that may include them.
const std::map<std::string, std::set<std::string>> kPackages{
    {"<embree", {"engine/scene/accelerator.cpp"}},
    {"<flann/", {"kdtree/point_tree.cpp"}},
    {"<omp.h>", {"engine/base/parallel.h"}},
    {"<OpenEXR/", {"engine/image/exr.cpp", "engine/image/exr_guard.cpp", "lights/light_field_io.cpp"}},
    {"<Imf", {"engine/image/exr.cpp", "lights/light_field_io.cpp"}},
    {"<mpi.h>", {"engine/mpi/open_mpi.cpp"}},
    {"<OpenImageIO/", {"engine/pictures/open_image_io.cpp"}},
    {"<png.h>", {"engine/image/png.cpp"}},
    {"<librsvg/", {"engine/pictures/svg.cpp"}},
    {"<fontconfig/", {"engine/pictures/svg.cpp"}},
    {"<dlfcn.h>",
     {"engine/system/module.cpp", "engine/pictures/svg.cpp", "tests/process/preload/other_isa.cpp",
      "tests/process/preload/kill_at_file.cpp"}},
    {"<opensubdiv/", {"engine/scene/loop.cpp"}},
    {"<zlib.h>", {"engine/system/gzip.cpp", "engine/image/png_guard.cpp"}},
    {"<zip.h>", {"engine/system/zip_archive.cpp"}},
    {"<pugixml", {"engine/text/xml.cpp"}},
    {"<hwy/", {"lights/eight_lanes.h"}},
    {"<Random123/", {"engine/base/sampler.cpp"}},
    {"<tiny_gltf", {"engine/model/gltf_reader.h"}},
    {"<tiny_obj_loader", {"engine/model/read_obj.cpp"}},
    {"<toml++/", {"engine/system/toml.cpp"}},
    {"<pybind11/",
     {"python/bindings/arrays.h", "python/bindings/bindings.h", "python/bindings/images.cpp",
      "python/bindings/lamps.cpp", "python/bindings/maps.cpp", "python/bindings/module.cpp",
      "python/bindings/python_monitor.h", "python/bindings/scenes.cpp"}},
};

// The only files that may open a stream for reading: the common reader, and code that queries the system.
const std::set<std::string> kOpeners{"engine/system/files.h", "engine/system/files.cpp",
                                     "engine/system/memory.cpp", "engine/cli/render/run_report.cpp"};

// Returns the module whose folder contains the path; empty if there is none (tests, bench).
std::string module_of(const std::string& path) {
    std::string found;  // the longest one: a module's folder may lie in another's
    for (const auto& [module, below] : kModules) {
        if (path.starts_with(module + "/") && module.size() > found.size()) found = module;
    }
    return found;
}

bool may_include(const std::string& from, const std::string& to) {
    if (from == to) return true;
    for (const std::string& below : kModules.at(from)) {
        if (may_include(below, to)) return true;
    }
    return false;
}

std::string_view trimmed(std::string_view line) {
    const std::size_t first = line.find_first_not_of(" \t");
    return first == std::string_view::npos ? std::string_view() : line.substr(first);
}

// Returns the argument of #include with its quotes or brackets; empty if the line includes nothing.
std::string included(std::string_view line) {
    line = trimmed(line);
    if (!line.starts_with('#')) return {};
    line = trimmed(line.substr(1));
    if (!line.starts_with("include")) return {};
    line = trimmed(line.substr(7));
    const std::size_t end = line.find_first_of("\">", 1);
    return std::string(line.substr(0, end == std::string_view::npos ? end : end + 1));
}

class Checker {
  public:
    void check(const std::string& path, const std::string& text) {
        std::istringstream lines(text);
        std::string line;
        bool once = false;
        for (int number = 1; std::getline(lines, line); ++number) {
            if (number == 1 && is_header(path) && !line.starts_with("//")) {
                report(path, number, "a header starts with a comment that says what it is");
            }
            once = once || line == "#pragma once";
            check_line(path, number, line);
        }
        if (is_header(path) && !once) report(path, 1, "a header has #pragma once");
    }

    const std::vector<std::string>& violations() const { return violations_; }

  private:
    static bool is_header(const std::string& path) { return path.ends_with(".h"); }

    void report(const std::string& path, int line, const std::string& what) {
        violations_.push_back(fmt::format("{}:{}: {}", path, line, what));
    }

    void check_line(const std::string& path, int number, const std::string& line) {
        const std::string_view code = trimmed(line);
        const bool in_module = !module_of(path).empty();
        // A test or a benchmark is a program of its own: its sources may open a namespace, its headers may
        // not.
        if (code.starts_with("using namespace") && (in_module || is_header(path))) {
            report(path, number, "no using namespace");
        }
        static const std::regex kOfTheCLibrary(
            R"(std::(acos|asin|atan|atan2|cbrt|cos|exp|exp2|expm1|hypot|log|log10|log1p|log2|pow|sin|tan)f?\()");
        if (in_module && line.find("std::") != line.npos && std::regex_search(line, kOfTheCLibrary))
            report(path, number, "elementary functions are those of engine/base/elementary.h");
        if (in_module && module_of(path) != "engine/cli" && line.find("std::exit") != std::string::npos) {
            report(path, number, "no library ends the process");
        }
        if (code.starts_with("#pragma omp") && path != "engine/base/parallel.h") {
            report(path, number, "only engine/base/parallel.h writes #pragma omp");
        }
        static const std::regex opens_to_read("std::ifstream(\\s+\\w+)?[({]");
        if (in_module && !kOpeners.contains(path) && std::regex_search(line, opens_to_read)) {
            report(path, number, "files are opened to read by open_to_read()");
        }
        const std::string header = included(line);
        if (header.starts_with('"')) check_module(path, number, header.substr(1, header.size() - 2));
        if (in_module) check_package(path, number, header);
    }

    void check_module(const std::string& path, int number, const std::string& header) {
        const std::string from = module_of(path);
        const std::string to = module_of(header);
        if (from.empty()) return;  // tests and benchmarks may include any module
        if (to.empty()) {
            report(path, number, fmt::format("\"{}\" is in no module that {} may include", header, from));
        } else if (!may_include(from, to)) {
            report(path, number, fmt::format("{} may not include {} (\"{}\")", from, to, header));
        }
    }

    void check_package(const std::string& path, int number, const std::string& header) {
        for (const auto& [package, files] : kPackages) {
            if (header.starts_with(package) && !files.contains(path)) {
                report(path, number, fmt::format("{} is not to be named here", header));
            }
        }
    }

    std::vector<std::string> violations_;
};

std::vector<std::string> violations_in(const std::string& path, const std::string& text) {
    Checker checker;
    checker.check(path, text);
    return checker.violations();
}

bool is_source(const std::filesystem::path& path) {
    return path.extension() == ".h" || path.extension() == ".cpp";
}

TEST(Architecture, Sources_OfTheRepository_KeepToTheirModules) {
    const std::filesystem::path root = LUCERNA_SOURCE_DIR;
    Checker checker;
    std::map<std::string, int> files;
    for (const char* top : {"engine", "kdtree", "lights", "photon", "python", "tests", "bench"}) {
        ASSERT_TRUE(std::filesystem::exists(root / top)) << top;
        for (const auto& entry : std::filesystem::recursive_directory_iterator(root / top)) {
            if (!entry.is_regular_file() || !is_source(entry.path())) continue;
            const std::string path = std::filesystem::relative(entry.path(), root).generic_string();
            std::ostringstream text;
            text << std::ifstream(entry.path()).rdbuf();
            checker.check(path, text.str());
            ++files[module_of(path)];
        }
    }
    for (const std::string& violation : checker.violations()) ADD_FAILURE() << violation;
    // The test must have found the sources of these modules.
    for (const char* module :
         {"engine/base", "engine/scene", "engine/vpl", "engine/guiding", "engine/integrators",
          "engine/render", "engine/evaluation", "photon", "lights", "lights/measurement", "kdtree"}) {
        EXPECT_GT(files[module], 3) << module;
    }
}

TEST(Architecture, Sources_OutsideAModule_HaveNoFolderOfTheirOwnInTheEngine) {
    const std::filesystem::path engine = std::filesystem::path(LUCERNA_SOURCE_DIR) / "engine";
    for (const auto& entry : std::filesystem::directory_iterator(engine)) {
        const std::string module = "engine/" + entry.path().filename().string();
        EXPECT_TRUE(kModules.contains(module)) << module << " is not a module";
    }
}

std::string text_of(const std::filesystem::path& file) {
    std::ostringstream text;
    text << std::ifstream(file).rdbuf();
    return text.str();
}

// Returns the links of a page to functions, [`Class::name`](../file#L12), that lead to a line without that
// name, or to a mere declaration.
std::vector<std::string> stale_links(const std::filesystem::path& folder, const std::string& page) {
    static const std::regex link(R"(\[`([\w:]+)`\]\(([^)#]+)#L(\d+)\))");
    std::vector<std::string> stale;
    for (std::sregex_iterator at(page.begin(), page.end(), link), end; at != end; ++at) {
        const std::string name = (*at)[1], file = (*at)[2];
        std::istringstream lines(text_of(folder / file));
        std::string line;
        for (int left = std::stoi((*at)[3]); left > 0; --left) {
            line.clear();
            std::getline(lines, line);
        }
        const std::size_t colons = name.rfind("::");
        const std::string last = colons == std::string::npos ? name : name.substr(colons + 2);
        const bool is_declaration = line.ends_with(';') && line.find('{') == std::string::npos;
        if (line.find(last) == std::string::npos || is_declaration) stale.push_back(at->str());
    }
    return stale;
}

TEST(Pages, LinksToFunctions_LeadToTheirLines) {
    const std::filesystem::path docs = std::filesystem::path(LUCERNA_SOURCE_DIR) / "docs/explanation";
    for (const char* name : {"photon-maps.md", "../reference/layers.md", "../howto/cluster.md"}) {
        const std::string page = text_of(docs / name);
        EXPECT_THAT(page, HasSubstr("#L"));
        EXPECT_THAT(stale_links((docs / name).parent_path(), page), IsEmpty());
    }
    EXPECT_THAT(stale_links(docs, "[`map_of`](../../photon/deposit.h#L1)"), ::testing::SizeIs(1));
    EXPECT_THAT(stale_links(docs, "[`map_of`](../../photon/no_such_file.h#L31)"), ::testing::SizeIs(1));
}

// Returns the citations in brackets, by author and year, in comments and pages: "Jensen 2001" for [Jensen
// 2001, 7.2].
std::set<std::string> citations_in(const std::string& text) {
    static const std::regex bracket(R"(\[([A-Z][^\]\[]*\b(1[89]|20)\d\d\b[^\]\[]*)\])");
    static const std::regex comment(R"(\n\s*(//|#)?\s*)");
    static const std::regex source(R"(^\s*([^\s;,:0-9][^;,:0-9]* (1[89]|20)\d\d)\b)");
    std::set<std::string> found;
    for (std::sregex_iterator at(text.begin(), text.end(), bracket), end; at != end; ++at) {
        std::istringstream parts(std::regex_replace((*at)[1].str(), comment, " "));
        for (std::string part; std::getline(parts, part, ';');) {
            std::smatch cited;
            if (std::regex_search(part, cited, source)) found.insert(cited[1]);
        }
    }
    return found;
}

TEST(Citations, EachLeadsToTheBibliography_AndEachEntryIsCited) {
    const std::filesystem::path root = LUCERNA_SOURCE_DIR;
    const std::string bibliography = text_of(root / "docs/development/bibliography.md");
    std::string all;
    std::set<std::string> cited;
    for (const char* top :
         {"engine", "kdtree", "lights", "photon", "python", "bench", "tests", "docs", "scenes"}) {
        for (const auto& entry : std::filesystem::recursive_directory_iterator(root / top)) {
            const std::filesystem::path& path = entry.path();
            if (!entry.is_regular_file() || path.filename() == "bibliography.md") continue;
            if (!is_source(path) && path.extension() != ".py" && path.extension() != ".md") continue;
            if (path.filename() == "architecture_test.cpp") continue;  // examples
            const std::string text = text_of(path);
            cited.merge(citations_in(text));
            all += text;
        }
    }
    EXPECT_GT(cited.size(), 30U);
    for (const std::string& citation : cited) {
        EXPECT_NE(bibliography.find("* **" + citation + ".**"), std::string::npos)
            << citation << " is not in docs/development/bibliography.md";
    }
    static const std::regex entry(R"(\n\* \*\*([^*]+)\.\*\*)");
    for (std::sregex_iterator at(bibliography.begin(), bibliography.end(), entry), end; at != end; ++at) {
        const std::string source = (*at)[1];
        EXPECT_TRUE(cited.contains(source) || all.find(source) != std::string::npos)
            << source << " is cited nowhere";
    }
}

TEST(Citations, OfATextAreFound) {
    EXPECT_EQ(citations_in("as [Jensen 2001, 7.2; Knaus and\n// Zwicker 2011] has it, not [0, 1] or a[2001]"),
              (std::set<std::string>{"Jensen 2001", "Knaus and Zwicker 2011"}));
}

TEST(ArchitectureChecker, AllowedLines_AreSilent) {
    EXPECT_THAT(
        violations_in("lights/measurement/a.cpp",
                      "#include \"lights/light_field.h\"\n#include \"lights/measurement/opacity.h\"\n"),
        IsEmpty());
    EXPECT_THAT(violations_in("photon/a.cpp",
                              "#include <vector>\n#include \"kdtree/point_tree.h\"\n"
                              "#include \"engine/base/vec.h\"\n#include \"photon/photon.h\"\n"),
                IsEmpty());
    EXPECT_THAT(violations_in("engine/cli/a.cpp", "#include \"engine/base/vec.h\"\n"), IsEmpty());
    EXPECT_THAT(violations_in("engine/scene/accelerator.cpp", "#include <embree3/rtcore.h>\n"), IsEmpty());
    EXPECT_THAT(
        violations_in("tests/a.cpp", "#include \"tests/support/x.h\"\n#include \"photon/light_path.h\"\n"),
        IsEmpty());
    EXPECT_THAT(violations_in("engine/base/a.h", "// What it is.\n#pragma once\n"), IsEmpty());
}

TEST(ArchitectureChecker, ForbiddenEdges_AreReportedWithTheirLine) {
    const auto violation = [](const std::string& path, const std::string& text) {
        const auto all = violations_in(path, text);
        return all.size() == 1 ? all.front() : fmt::format("{} violations", all.size());
    };
    EXPECT_EQ(violation("lights/a.cpp", "\n#include \"engine/scene/scene.h\"\n"),
              "lights/a.cpp:2: lights may not include engine/scene (\"engine/scene/scene.h\")");
    EXPECT_THAT(violation("kdtree/a.cpp", "#include \"lights/light.h\""),
                HasSubstr("kdtree may not include lights"));
    EXPECT_THAT(violation("lights/a.cpp", "#include \"lights/measurement/opacity.h\""),
                HasSubstr("lights may not include lights/measurement"));
    EXPECT_THAT(violation("lights/a.cpp", "#include \"kdtree/point_tree.h\""),
                HasSubstr("may not include kdtree"));
    EXPECT_THAT(violation("engine/scene/a.cpp", "  #  include \"kdtree/point_tree.h\""),
                HasSubstr("may not include"));
    EXPECT_THAT(violation("engine/base/a.cpp", "#include \"photon/light_path.h\""),
                HasSubstr("may not include photon"));
    EXPECT_THAT(violation("photon/a.cpp", "#include \"engine/render/film.h\""), HasSubstr("may not include"));
    EXPECT_THAT(violation("photon/a.cpp", "#include \"tests/support/scenes.h\""), HasSubstr("in no module"));
    EXPECT_THAT(violation("photon/a.cpp", "#include \"light_path.h\""), HasSubstr("in no module"));
}

TEST(ArchitectureChecker, PackagesOutsideTheirFile_AreReported) {
    for (const char* line : {"#include <embree3/rtcore.h>", "#include <flann/flann.hpp>", "#include <omp.h>",
                             "#pragma omp parallel for", "#include <OpenEXR/ImfHeader.h>",
                             "#include <ImfHeader.h>", "#include <OpenImageIO/imageio.h>"}) {
        EXPECT_THAT(violations_in("engine/render/a.cpp", line), ::testing::SizeIs(1)) << line;
    }
    EXPECT_THAT(violations_in("tests/a.cpp", "#pragma omp parallel"), ::testing::SizeIs(1));
    EXPECT_THAT(violations_in("engine/scene/scene.h", "// x\n#pragma once\n#include <embree3/rtcore.h>"),
                ::testing::SizeIs(1));
}

TEST(ArchitectureChecker, FilesOpenedInAnotherWay_AreReported) {
    for (const char* line : {"std::ifstream in(file, std::ios::binary);", "  std::ifstream(file).read(x, 2);",
                             "const auto text = read(std::ifstream{file});"}) {
        EXPECT_THAT(violations_in("lights/a.cpp", line), ::testing::SizeIs(1)) << line;
        EXPECT_THAT(violations_in("engine/system/files.cpp", line), IsEmpty()) << line;
        EXPECT_THAT(violations_in("tests/a.cpp", line), IsEmpty()) << line;
    }
    for (const char* line : {"std::ifstream in = open_to_read(file);", "std::ofstream out(temporary);",
                             "Head read_head(std::ifstream& in);", "    std::ifstream in_;"})
        EXPECT_THAT(violations_in("lights/a.cpp", line), IsEmpty()) << line;
}

TEST(ArchitectureChecker, HeadersWithoutTheirHabits_AreReported) {
    EXPECT_THAT(violations_in("photon/a.h", "#pragma once\n"), ::testing::SizeIs(1));
    EXPECT_THAT(violations_in("photon/a.h", "// A comment.\nint x;\n"), ::testing::SizeIs(1));
    EXPECT_THAT(violations_in("photon/a.cpp", "  using namespace std;\n"), ::testing::SizeIs(1));
    EXPECT_THAT(violations_in("tests/a.h", "// X.\n#pragma once\nusing namespace std;"),
                ::testing::SizeIs(1));
    EXPECT_THAT(violations_in("tests/a_test.cpp", "using namespace std;"), IsEmpty());
    EXPECT_THAT(violations_in("photon/a.cpp", "    std::exit(1);\n"), ::testing::SizeIs(1));
}

}  // namespace architecture_test
}  // namespace lucerna
