// The renders of a study. Each is made once, stored under a hash of its inputs, and found again the next
// time.
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
    bool found = false;         // already stored
    std::string machine, date;  // place and date of the render (run_report.h); empty: unknown
    int threads = 0;
    std::string host;  // of the rank that made it; empty: made by a single process
};

// One render of a study. Its scene and point must outlive it.
struct StudyWork {
    const StudyScene* scene;
    const StudyPoint* point;
    std::uint64_t seed;
    bool is_reference = false;
};

class StudyRuns {
  public:
    // The environment of a study's renders. `files` and `around` must outlive this object.
    struct Command {
        CommandFiles& files;
        const ProcessContext& process;
        Workers workers;
        bool strict;  // turns warnings about replaced or omitted parts of a scene into errors
        std::optional<FluxUnit> unit;  // SceneOverrides::unit
        Ranks* ranks;                  // null for a single process
    };
    // Rank 0 creates `folder` if it is missing. Throws InputError.
    StudyRuns(std::filesystem::path folder, const Command& command);

    // Reads every scene once, so that an error in the last one is found before the renders of the others.
    // Throws InputError naming the scene's place in the description.
    void check(std::span<const StudyWork> all, Monitor& monitor);

    // Makes or finds a render. Returns nothing, and stores nothing, if the monitor stopped it. Its name is a
    // hash of the scene's files, all settings, the seed and the version, so a change of any of them makes a
    // new render. Throws InputError.
    std::optional<StudyRun> run(const StudyWork& work, Monitor& monitor);

    // Makes or finds all renders of a study by ranks. Each rank renders its share alone, one after the other,
    // with the times of its own host. Rank 0 calls `when_made` for each result, from any thread but one at a
    // time, and returns the runs by work, empty where its monitor stopped. Collective.
    using WhenMade = std::function<void(const StudyWork& work, const StudyRun& run, int rank)>;
    std::vector<std::optional<StudyRun>> run_by_ranks(std::span<const StudyWork> all, Monitor& monitor,
                                                      const WhenMade& when_made);

  private:
    // A render that is not stored yet.
    struct Made {
        std::string name;              // hash of its inputs
        std::vector<std::byte> image;  // content of the file; empty: already stored
        std::string notes;
        std::vector<std::string> warnings;

        template <typename Archive>
        void fields(Archive& archive) {
            archive(name, image, notes, warnings);
        }
    };
    // `listening` is set once there are results to keep.
    std::optional<Made> make(const StudyWork& work, Monitor& monitor,
                             std::optional<StopOnSignals>& listening);
    StudyRun keep(const Made& made) const;
    Job read(const StudyWork& work, Monitor& monitor);
    void find_kept();
    std::filesystem::path image_of(const std::string& name) const { return folder_ / (name + ".exr"); }
    std::filesystem::path notes_of(const std::string& name) const { return folder_ / (name + ".json"); }

    std::filesystem::path folder_;
    Command command_;
    std::set<std::filesystem::path> scenes_;  // whose files the command knows
    std::set<std::string> kept_;              // names, as found by rank 0
};

}  // namespace lucerna
