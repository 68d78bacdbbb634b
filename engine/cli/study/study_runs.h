// The renders of a study: each is made once, kept by what it was made of, and found again the next time.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/cli/command_files.h"
#include "engine/cli/commands.h"
#include "engine/cli/run.h"
#include "engine/evaluation/study.h"
#include "engine/ranks/ranks.h"
#include "engine/render/job.h"

namespace lucerna {

struct StudyRun {
    std::filesystem::path image;
    double seconds = 0;         // reading, preparation and image
    bool found = false;         // it was there already
    std::string machine, date;  // run_report.h; where and when it was made; empty: not known
    int threads = 0;
    std::string host;  // of the rank that made it; empty: made by one process alone
};

// One render of a study, of what outlives this.
struct StudyWork {
    const StudyScene* scene;
    const StudyPoint* point;
    std::uint64_t seed;
    bool is_reference = false;
};

class StudyRuns {
  public:
    // What a study's renders work under. Both outlive this.
    struct Command {
        CommandFiles& files;
        const Surroundings& around;
        Workers workers;
        bool strict;  // what a scene's reader would replace or leave out with a warning is an error
        std::optional<FluxUnit> unit;  // SceneOverrides::unit
        Ranks* ranks;                  // null: this process alone
    };
    // `folder` is made if it is not there, by rank 0. Throws InputError.
    StudyRuns(std::filesystem::path folder, const Command& command);

    // Reads every scene once, so that a fault in the last one does not come out after the renders of the
    // others. Throws InputError that names the scene's place in the description.
    void check(std::span<const StudyWork> all, Monitor& monitor);

    // None if the monitor wished to stop; nothing is kept of that render then. A render is named by a hash of
    // the scene's files, every setting, the seed and the version: whatever changes one of them makes a new
    // one. Throws InputError.
    std::optional<StudyRun> run(const StudyWork& work, Monitor& monitor);

    // The same for all of a study, by ranks: each renders by itself what it gets, one after the other, and
    // its times are those of its own host. `when_made`, at rank 0 and from any thread but never two: what
    // came in. Returns there what was made or found, by work; none where the monitor of rank 0 wished to
    // stop. Collective.
    using WhenMade = std::function<void(const StudyWork& work, const StudyRun& run, int rank)>;
    std::vector<std::optional<StudyRun>> run_by_ranks(std::span<const StudyWork> all, Monitor& monitor,
                                                      const WhenMade& when_made);

  private:
    // A render that is not kept yet.
    struct Made {
        std::string name;              // by what it was made of
        std::vector<std::byte> image;  // a file's; empty: it was there already
        std::string notes;
        std::vector<std::string> warnings;

        template <typename Archive>
        void fields(Archive& archive) {
            archive(name, image, notes, warnings);
        }
    };
    // `listening`: from when there is something to keep.
    std::optional<Made> make(const StudyWork& work, Monitor& monitor, std::optional<Listening>& listening);
    StudyRun keep(const Made& made) const;
    Job read(const StudyWork& work, Monitor& monitor);
    void find_kept();
    std::filesystem::path image_of(const std::string& name) const { return folder_ / (name + ".exr"); }
    std::filesystem::path notes_of(const std::string& name) const { return folder_ / (name + ".json"); }

    std::filesystem::path folder_;
    Command command_;
    std::set<std::filesystem::path> scenes_;  // whose files the command knows
    std::set<std::string> kept_;              // by name, as rank 0 found them
};

}  // namespace lucerna
