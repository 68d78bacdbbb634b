// lucerna study: methods × settings × seeds × scenes against a reference.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "engine/app/commands.h"
#include "engine/app/console.h"
#include "engine/app/options.h"
#include "engine/app/outputs.h"
#include "engine/app/study_plan.h"
#include "engine/app/study_runs.h"
#include "engine/app/study_trade.h"
#include "engine/base/error.h"
#include "engine/base/files.h"
#include "engine/render/compare.h"

namespace lucerna {
namespace {

constexpr const char* kFooter = R"(STUDY.toml names scenes, a reference and methods:

  title = "Direct light, four ways"
  seeds = 2                                    # renders of each point; two or more tell bias from noise

  [[scene]]
  file = "../scenes/cloister/cloister.pbrt"    # from the folder of the study
  resolution = "120x80"                        # default: the scene's own
  mask = 4                                     # leave out pixels of which the reference is brighter

  [reference]
  integrator = "path"
  spp = [1024]

  [[method]]
  name = "guided"
  integrator = "photonmap"
  set = "indirect=none direct=guided candidates=4|16"    # | between alternatives: each is tried
  spp = [4, 16, 64]

Every render is kept in DIR/runs by what it was made of. Ctrl-C, or a kill, loses the one at hand; the same command
goes on from there, and renders what has changed since. Results: DIR/results.csv and DIR/results.json. Error is the
root of the mean of (t - r)^2 / (r^2 + 0.0001), of one image. Times are those of this machine: let it do nothing else.

Examples:
  lucerna study direct.toml -o out/direct
  lucerna study direct.toml -o out/direct --threads 1)";

// Seeds of methods begin at 0; the reference must share none with them.
constexpr std::uint64_t kReferenceSeed = std::uint64_t{1} << 40;

struct StudyCommand {
    std::string file, folder;
    Workers workers;
};

StudyResult measured(const StudyScene& scene, const StudyPoint& point, const std::vector<NamedImage>& images,
                     const NamedImage& reference) {
    StudyResult result;
    result.scene = scene.name;
    result.method = point.method;
    result.settings = point.settings;
    const NamedImage mean{"the mean of " + images.front().name, mean_image(images)};
    const Comparison numbers =
        compare(mean.image, reference.image, mean.name, reference.name, scene.mask_above);
    double lit = 0, wanted = 0;
    for (const ChannelComparison& channel : numbers.channels) {
        lit += channel.mean;
        wanted += channel.reference_mean;
    }
    result.mean_ratio = wanted != 0 ? lit / wanted : 1;
    result.error2 = numbers.relative_mse;
    if (images.size() > 1) {
        const BiasAndNoise parts = bias_and_noise(images, reference, scene.mask_above);
        result.error2 = parts.relative.mse.value;
        result.bias2 = parts.relative.bias2;
        result.noise2 = parts.relative.noise2;
    }
    return result;
}

class Study {
  public:
    Study(const StudyPlan& plan, const StudyRuns& runs, Monitor& monitor)
        : plan_(plan), runs_(runs), monitor_(monitor) {}

    // Less than all where the monitor wished to stop.
    std::vector<StudyResult> all() {
        std::vector<StudyResult> results;
        for (const StudyScene& scene : plan_.scenes) {
            const auto reference = image(scene, plan_.reference, kReferenceSeed);
            if (!reference) break;
            for (const StudyPoint& point : plan_.points) {
                double seconds = 0;
                std::vector<NamedImage> images;
                for (int seed = 0; seed < plan_.seeds; ++seed) {
                    const auto one = image(scene, point, static_cast<std::uint64_t>(seed));
                    if (!one) return results;
                    seconds += one->seconds / plan_.seeds;
                    images.push_back(one->image);
                }
                results.push_back(measured(scene, point, images, reference->image));
                results.back().seconds = seconds;
            }
        }
        return results;
    }
    std::size_t rendered() const { return rendered_; }
    std::size_t found() const { return found_; }

  private:
    struct Rendered {
        NamedImage image;
        double seconds;
    };
    std::optional<Rendered> image(const StudyScene& scene, const StudyPoint& point, std::uint64_t seed) {
        monitor_.info(fmt::format("{}: {}, {}, seed {}", scene.name, point.method, point.settings, seed));
        const auto run = runs_.run(scene, point, seed, monitor_);
        if (!run) return {};
        ++(run->found ? found_ : rendered_);
        return Rendered{{run->image.string(), read_exr(run->image)}, run->seconds};
    }

    const StudyPlan& plan_;
    const StudyRuns& runs_;
    Monitor& monitor_;
    std::size_t rendered_ = 0, found_ = 0;
};

void act(const StudyCommand& command, const CommandContext& context) {
    const StudyPlan plan = read_study(command.file);
    const std::filesystem::path folder = command.folder;
    const StudyRuns runs(folder / "runs", command.workers);
    require_writable(folder / "results.csv", ".csv");
    require_writable(folder / "results.json", ".json");
    ConsoleMonitor monitor(context.out, context.err,
                           {context.around.terminal, false, context.around.stop, {}});
    Study study(plan, runs, monitor);
    std::vector<StudyResult> results = study.all();
    mark_best(results);
    if (results.size() < plan.points.size() * plan.scenes.size()) {
        monitor.info(fmt::format("stopped: {} of {} points are measured; the same command goes on",
                                 results.size(), plan.points.size() * plan.scenes.size()));
        if (results.empty()) return;
    }
    write_text(folder / "results.csv", study_csv(results));
    write_text(folder / "results.json", study_json(plan, results));
    monitor.info(fmt::format("renders  {} made, {} found", study.rendered(), study.found()));
    for (const std::string& line : advice(results)) monitor.info(line);
    monitor.info(fmt::format("results  {}", (folder / "results.csv").string()));
}

}  // namespace

void add_study_command(CLI::App& program, const CommandContext& context) {
    const auto command = std::make_shared<StudyCommand>();
    CLI::App& app =
        *program.add_subcommand("study", "Measure methods and settings against a reference: error and time");
    app.footer(kFooter);
    app.add_option("STUDY", command->file, "what to measure, a TOML file")
        ->required()
        ->type_name("STUDY.toml");
    app.add_option("-o,--output", command->folder,
                   "folder of the renders and results; made if it is not there")
        ->required()
        ->type_name("DIR");
    add_threads(app, command->workers);
    app.callback([command, &context] { act(*command, context); });
}

}  // namespace lucerna
