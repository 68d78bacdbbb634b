// The renders of a study: each is made once, kept by what it was made of, and found again the next time.
#pragma once

#include <filesystem>
#include <optional>
#include <set>
#include <string>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/cli/command_files.h"
#include "engine/cli/run.h"
#include "engine/evaluation/study.h"

namespace lucerna {

struct StudyRun {
    std::filesystem::path image;
    double seconds = 0;         // reading, preparation and image
    bool found = false;         // it was there already
    std::string machine, date;  // run_report.h; where and when it was made; empty: not known
    int threads = 0;
};

class StudyRuns {
  public:
    // What a study's renders work under. Both outlive this.
    struct Command {
        CommandFiles& files;
        const Surroundings& around;
        Workers workers;
        bool strict;  // what a scene's reader would replace or leave out with a warning is an error
    };
    // `folder` is made if it is not there. Throws InputError.
    StudyRuns(std::filesystem::path folder, const Command& command);

    // None if the monitor wished to stop; nothing is kept of that render then. A render is named by a hash of
    // the scene's files, every setting, the seed and the version: whatever changes one of them makes a new
    // one. Throws InputError.
    std::optional<StudyRun> run(const StudyScene& scene, const StudyPoint& point, std::uint64_t seed,
                                Monitor& monitor);

  private:
    std::filesystem::path folder_;
    Command command_;
    std::set<std::filesystem::path> scenes_;  // whose files the command knows
};

}  // namespace lucerna
