// lucerna study: measures methods × settings × seeds × scenes against a reference.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "engine/base/error.h"
#include "engine/base/monitor.h"
#include "engine/cli/command_files.h"
#include "engine/cli/commands.h"
#include "engine/cli/console.h"
#include "engine/cli/parallel_job.h"
#include "engine/cli/study/study_page.h"
#include "engine/cli/study/study_runs.h"
#include "engine/evaluation/study.h"
#include "engine/system/files.h"

namespace lucerna {
namespace {

constexpr const char* kStudyFooter = R"(STUDY.toml names scenes, a reference and methods:

  title = "Direct light, four ways"
  seeds = 2                                    # renders of each point; two or more separate bias from noise

  [[scene]]
  file = "../scenes/cloister/cloister.pbrt"    # relative to the folder of the study
  resolution = "120x80"                        # default: from the scene
  mask = 4                                     # leave out pixels where the reference is above this value
  mask_lamps = true                            # leave out pixels that see a lamp or the sky, also in mirrors and glass

  [reference]
  integrator = "path"
  spp = [1024]

  [[method]]
  name = "guided"
  integrator = "photonmap"
  set = "indirect=none direct=guided candidates=4|16"    # | separates alternatives; each is measured
  spp = [4, 16, 64]                            # or times, with reading: time = ["5s", "2min"]

Every render is kept in DIR/runs, under a name made from its inputs. If the study is interrupted or killed, only the current
render is lost; the same command continues from there, and repeats the renders whose inputs have changed. Times are measured
on this machine: run nothing else on it.

Under mpirun or srun --mpi=pmix the ranks share the renders: each makes one at a time with its own --threads, and rank 0 saves
and measures them. Images and errors are the same as with one process. Times are those of the host that made the render,
which is named in DIR/results.json: all hosts should be of the same kind, and no host should have more threads than
processors.

Results: DIR/study.html, one page with plots, images and all numbers; and the numbers as DIR/results.csv and
DIR/results.json. The error is that of a single image, as in render --error: the root mean square, over the pixels, of the
difference of luminance relative to the reference's luminance (plus a tenth of its mean).

Examples:
  lucerna study direct.toml -o out/direct
  lucerna study direct.toml -o out/direct --threads 1)";

// The seeds of methods begin at 0, and the reference must not share one with them.
constexpr std::uint64_t kReferenceSeed = std::uint64_t{1} << 40;

struct StudyCommand {
    std::string file, folder;
    bool strict = false;
    std::optional<FluxUnit> unit;  // none: each scene's own
    bool quiet = false;
    Workers workers;
};

// Returns all renders in the order in which results need them.
std::vector<StudyWork> work_of(const StudyDescription& description) {
    std::vector<StudyWork> all;
    for (const StudyScene& scene : description.scenes) {
        all.push_back({&scene, &description.reference, kReferenceSeed, true});
        for (const StudyPoint& point : description.points) {
            for (int seed = 0; seed < description.seeds; ++seed)
                all.push_back({&scene, &point, static_cast<std::uint64_t>(seed)});
        }
    }
    return all;
}

std::string work_text(const StudyWork& work) {
    return fmt::format("{}: {}, {}, seed {}", work.scene->name, work.point->method, work.point->settings,
                       work.seed == kReferenceSeed ? 0 : work.seed);
}

class Study {
  public:
    // `ranks` is null, or that of rank 0.
    Study(const StudyDescription& description, StudyRuns& runs, Ranks* ranks, Monitor& monitor)
        : description_(description), runs_(runs), monitor_(monitor), all_(work_of(description)) {
        if (description.scenes.size() > 1) {  // with one scene the first render checks it
            Monitor silent;                   // the renders repeat its warnings
            runs_.check(all_, silent);
        }
        if (ranks) made_ = made_by(*ranks);
    }

    // Returns fewer than all results if the monitor stopped; with ranks, those made by then.
    std::vector<StudyResult> all() {
        std::vector<StudyResult> results;
        for (const StudyScene& scene : description_.scenes) {
            const auto run = next_run();
            if (!run) break;
            note(*run);
            const NamedImage reference = read_reference(run->image, scene);
            const std::size_t before = results.size();
            const StudyMeasure measure(reference, scene.mask_above);
            bool goes_on = true;
            for (const StudyPoint& point : description_.points) {
                auto result = measured(scene, point, measure);
                goes_on = result || made_;
                if (!goes_on) break;
                if (result) results.push_back(std::move(*result));
            }
            if (results.size() == before) break;
            references_.emplace_back(reference.name);
            if (!goes_on) break;
        }
        return results;
    }
    // References of the scenes that have results.
    const std::vector<std::filesystem::path>& references() const { return references_; }
    const StudyOrigin& origin() const { return origin_; }
    std::size_t rendered() const { return rendered_; }
    std::size_t found() const { return found_; }

  private:
    struct Rendered {
        NamedImage image;
        double seconds;
        std::string host;
    };
    std::optional<StudyResult> measured(const StudyScene& scene, const StudyPoint& point,
                                        const StudyMeasure& measure) {
        StudyResult result;
        result.scene = scene.name;
        result.method = point.method;
        result.settings = point.settings;
        result.set = point.overrides.set;
        result.set.emplace_back(point.end_name, point.end_value);
        std::vector<NamedImage> images;
        bool is_whole = true;
        for (int seed = 0; seed < description_.seeds; ++seed) {
            auto one = next_image();
            is_whole = is_whole && one;
            if (!one && !made_) return {};
            if (!one) continue;
            result.seconds += one->seconds / description_.seeds;
            if (!one->host.empty()) result.hosts.insert(one->host);
            images.push_back(std::move(one->image));
        }
        if (!is_whole) return {};
        result.image = images.front().name;
        measure.measure(images, result, monitor_);
        return result;
    }
    std::vector<std::optional<StudyRun>> made_by(Ranks& ranks) {
        return runs_.run_by_ranks(all_, monitor_, [&](const StudyWork& work, const StudyRun& run, int rank) {
            count(run);
            const std::string how = run.found ? "found"
                                              : fmt::format("rank {} on {}, {}", rank, ranks.host(rank),
                                                            duration_text(run.seconds));
            monitor_.info(
                fmt::format("{}/{}  {}: {}", rendered_ + found_, all_.size(), work_text(work), how));
        });
    }
    void count(const StudyRun& run) { ++(run.found ? found_ : rendered_); }
    std::optional<StudyRun> next_run() {
        const std::size_t i = next_++;
        if (made_) return (*made_)[i];
        monitor_.info(fmt::format("{}/{}  {}", i + 1, all_.size(), work_text(all_[i])));
        const auto run = runs_.run(all_[i], monitor_);
        if (run) count(*run);
        return run;
    }
    std::optional<Rendered> next_image() {
        const auto run = next_run();
        if (!run) return {};
        note(*run);
        return Rendered{{run->image.string(), read_exr(run->image)}, run->seconds, run->host};
    }
    void note(const StudyRun& run) {
        if (!run.machine.empty()) origin_.machines.insert(run.machine);
        if (!run.host.empty()) origin_.hosts.insert(run.host);
        if (!run.date.empty()) origin_.dates.insert(run.date);
        origin_.threads.insert(run.threads);
    }

    const StudyDescription& description_;
    StudyRuns& runs_;
    Monitor& monitor_;
    std::vector<StudyWork> all_;
    std::size_t next_ = 0;  // index in all_
    std::size_t rendered_ = 0, found_ = 0;
    std::optional<std::vector<std::optional<StudyRun>>> made_;  // by ranks
    std::vector<std::filesystem::path> references_;
    StudyOrigin origin_;
};

// Quotes a word for a shell's command line.
std::string shell_word(const std::string& word) {
    constexpr std::string_view kPlain =
        "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=./:,@%";
    if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) return word;
    std::string quoted = "'";
    for (const char c : word) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return quoted + "'";
}

std::string repeated(const StudyCommand& command) {
    const std::string threads = command.workers.threads == Workers{}.threads
                                    ? ""
                                    : fmt::format(" --threads {}", command.workers.threads);
    return fmt::format("lucerna study {} -o {}{}{}{}", shell_word(command.file), shell_word(command.folder),
                       command.strict ? " --strict" : "",
                       command.unit ? fmt::format(" --unit {}", unit_name(*command.unit)) : "", threads);
}

// Does the work of ranks other than 0.
void follow(const StudyCommand& command, const CommandContext& context, Ranks& ranks) {
    const StudyDescription description = read_study(command.file);
    CommandFiles none;
    StudyRuns runs({}, {none, context.process, command.workers, command.strict, command.unit, &ranks});
    Monitor silent;
    runs.run_by_ranks(work_of(description), silent, {});
}

void make_study(const StudyCommand& command, const CommandContext& context, Ranks* ranks) {
    const StudyDescription description = read_study(command.file);
    const std::filesystem::path folder = command.folder;
    CommandFiles files;
    files.reads(command.file);
    for (const StudyScene& scene : description.scenes) files.reads(scene.file);
    StudyRuns runs(folder / "runs",
                   {files, context.process, command.workers, command.strict, command.unit, ranks});
    for (const char* name : {"results.csv", "results.json", "study.html"})
        files.writes(folder / name, "", "study");
    const std::string description_text = read_text(command.file);
    ConsoleMonitor monitor(context.out, context.err,
                           {context.process.terminal, command.quiet, context.process.stop, {}});
    Study study(description, runs, ranks, monitor);
    std::vector<StudyResult> results = study.all();
    const StopOnSignals listening(context.process);
    mark_best(results);
    const std::size_t wanted = description.points.size() * description.scenes.size();
    const Stopped stopped(
        fmt::format("stopped: {} of {} points are measured; run the same command again to continue",
                    results.size(), wanted));
    if (results.empty()) throw Stopped(stopped);
    const std::vector<ScenePictures> pictures =
        study_pictures(description, study.references(), results, command.workers, monitor);
    write_text(folder / "results.csv", study_csv(results));
    write_text(folder / "results.json", study_json(description, results, study.origin()));
    write_text(folder / "study.html", study_page({description, results, pictures, study.origin(),
                                                  repeated(command), description_text}));
    monitor.info(fmt::format("renders  {} made, {} found", study.rendered(), study.found()));
    for (const std::string& line : advice(results)) monitor.info(line);
    for (const std::string& line : doubts(results)) monitor.warn(line);
    monitor.info(fmt::format("results  {}", (folder / "study.html").string()));
    if (results.size() < wanted) throw Stopped(stopped);
}

void act(const StudyCommand& command, const CommandContext& context) {
    const ParallelJob parallel(context, command.workers);
    parallel.run([&] {
        if (parallel.leads()) {
            make_study(command, context, parallel.ranks());
        } else {
            follow(command, context, *parallel.ranks());
        }
    });
}

}  // namespace

void add_study_command(CLI::App& program, const CommandContext& context) {
    const auto command = std::make_shared<StudyCommand>();
    CLI::App& app =
        *program.add_subcommand("study", "Measure methods and settings against a reference: error and time");
    app.footer(kStudyFooter);
    app.add_option("STUDY", command->file, "TOML file that describes what to measure")
        ->required()
        ->type_name("STUDY.toml");
    app.add_option("-o,--output", command->folder, "folder for the renders and results; created if needed")
        ->required()
        ->type_name("DIR");
    app.add_flag(
        "--strict", command->strict,
        "stop with an error, instead of a warning, if part of a scene cannot be rendered as specified");
    add_unit_option(app, command->unit);
    app.add_flag("--quiet", command->quiet, "print warnings and errors only");
    add_threads(app, command->workers);
    app.callback([command, &context] { act(*command, context); });
}

}  // namespace lucerna
