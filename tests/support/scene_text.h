// Reads scene text in tests, and returns the draft, the warnings or the error.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/pbrt/draft.h"
#include "engine/pbrt/read_scene.h"

namespace lucerna::testing {

class RecordingMonitor : public Monitor {
  public:
    void info(std::string_view line) override { infos.emplace_back(line); }
    void warn(std::string_view line) override { warnings.emplace_back(line); }

    std::vector<std::string> infos, warnings;
};

inline constexpr std::string_view kHead = "Camera \"perspective\" Film \"rgb\" WorldBegin\n";

struct Read {
    Draft draft;
    std::vector<std::string> warnings, infos;
};

// Reads the text of a whole scene file, named "scene.pbrt".
inline Read read_file_text(std::string text, const SceneOverrides& overrides = {}) {
    RecordingMonitor monitor;
    Read read{read_draft(std::move(text), "scene.pbrt", overrides, monitor), {}, {}};
    read.warnings = monitor.warnings;
    read.infos = monitor.infos;
    return read;
}

// Reads a world block, which begins on line 2.
inline Read read_world(std::string_view world) {
    return read_file_text(std::string(kHead) + std::string(world));
}

// Returns the error message of a strict reader, or "" if it accepts the text.
inline std::string refusal_of_file(std::string text, const SceneOverrides& overrides = {}) {
    SceneOverrides strict = overrides;
    strict.strict = true;
    try {
        read_file_text(std::move(text), strict);
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}
inline std::string refusal_of_world(std::string_view world) {
    return refusal_of_file(std::string(kHead) + std::string(world));
}

inline SceneParts parts_of_world(std::string_view world) {
    RecordingMonitor monitor;
    Draft draft = read_draft(std::string(kHead) + std::string(world), "scene.pbrt", {}, monitor);
    return assemble(std::move(draft), {1}, monitor).parts;
}

}  // namespace lucerna::testing
