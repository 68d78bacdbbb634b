// lucerna render: renders a scene file to an image.
#include <fmt/format.h>
#include <fmt/ostream.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <sstream>

#include "engine/base/error.h"
#include "engine/base/monitor.h"
#include "engine/cli/command_files.h"
#include "engine/cli/commands.h"
#include "engine/cli/console.h"
#include "engine/cli/parallel_job.h"
#include "engine/cli/render/checkpointing.h"
#include "engine/cli/render/part_files.h"
#include "engine/cli/render/render_request.h"
#include "engine/cli/render/run_report.h"
#include "engine/cli/render/scene_copy.h"
#include "engine/image/image.h"
#include "engine/pbrt/read_scene.h"
#include "engine/render/display/tev_display.h"
#include "engine/render/image_part.h"
#include "engine/render/job.h"
#include "engine/render/render.h"
#include "engine/system/files.h"
#include "engine/text/plain_text.h"
#include "photon/map_points.h"

namespace lucerna {
namespace {

constexpr const char* kRenderFooter = R"(Integrators and their parameters: lucerna info --integrators
Ctrl-C (SIGINT), SIGTERM and SIGHUP stop a render early and write the image rendered so far; the exit code is then 128
plus the signal's number, 130 for Ctrl-C. A second signal ends the program at once, as does the first one while the
scene is being read. An output must not be a file of the scene, or another output.

A render ends when it has all samples, when the time is up or when the error is small enough, whichever comes first.
With --time or --error, the number of samples in the scene is ignored. The time is that of the whole command. The error
is the root mean square, over the pixels, of the remaining noise relative to the pixel's luminance (plus a tenth of the
image's mean).

With --time or --error, and if neither integrator, parameters, samples, passes, maps nor checkpoint are given, Lucerna
chooses the method: it tries each suitable one (which computes the same picture as the scene's own) briefly on a few
blocks of pixels and takes the one with the least estimated error in the given time (or the least time to the given
error). It prints the options that repeat the choice.

With --png, --time or --error, and without a checkpoint, the image is denoised at the end: the picture shows the denoised
image, the image holds it as denoised.R, .G and .B in addition to the measured R, G and B, and the error is that of the
denoised image, including bias due to filtering. --no-denoise turns this off. lucerna denoise can denoise an image with
--layers later.

Lucerna stops with an error if an image, photon maps or virtual point lights do not fit into memory, and prints the
required and the available memory. A part of an image ("cropwindow") needs memory for that part only.

A scene file may hold several frames, each with WorldBegin and WorldEnd. Each frame is written to the file that its Film
names; if that name is already used, and for -o and all other files, the names of the second frame end in -2, and so on.
Time and error apply to each frame.

Colours are in linear sRGB, unless the scene ("ColorSpace" before Film) or --colour-space selects rec2020 or acescg, which
include saturated lamps that are outside sRGB, such as a green LED. The image states its chromaticities; pictures and
displays are in sRGB.

The picture of --png is exposed so that the mean luminance is middle grey; the brightest 5 % of the lit pixels (lamps and
fireflies) are not included in the mean. Values up to 0.8 of white are unchanged; brighter ones are compressed towards
white and keep their hue. --exposure, --tone and --white-balance change the picture, not the EXR image.

With --checkpoint, a render that was stopped or killed can be continued: with --resume it gives the same image, bit for
bit, as an uninterrupted render. All options must be the same except threads, time, error and a higher --spp. The file is
kept when the render is done, so that more samples can be added later; time is then counted from the first start. If both
options name the same file, it need not exist yet: the same command line then works for the start and for every restart.

Several machines can share one picture, each rendering a part of it (--part 3/16) with otherwise the same options; lucerna
merge combines the parts into the same picture, bit for bit, as one render with --no-adaptive (a part does not know which
pixels of the whole picture need the most samples). Each machine prepares for the whole picture. Use --denoise if the
merged picture is to be denoised.

mpirun, and srun --mpi=pmix, start one render with many processes (ranks), on one or several machines; the image is the
same, bit for bit, as with one process. All ranks read the scene (with --broadcast-scene, the first one sends it to the
others) and share light paths, preparation and tiles; the first one prints and writes everything. Time, error, checkpoints
and signals apply to the whole render, which can be continued with --resume on any number of ranks. One rank per machine
or socket, with one thread per processor, is best: docs/howto/cluster.md.

Examples:
  lucerna render room.pbrt -o out/room.exr --png
  lucerna render room.pbrt --integrator photonmap --set photons=2000000 --set k=200 --spp 32
  lucerna render room.pbrt --set quantity=illuminance -o lux.exr
  lucerna render room.pbrt --time 60s --png
  lucerna render room.pbrt --error 2%
  lucerna render room.pbrt --integrator progressive --time 30s --show-every 5s --png
  lucerna render room.pbrt --integrator progressive --error 1% --passes 2000
  lucerna render room.pbrt --spp 4096 --checkpoint room.checkpoint --resume room.checkpoint
  lucerna render room.pbrt --integrator progressive --time 5min --display localhost
  lucerna render room.pbrt --integrator path --spp 1024 --seed 7 -o reference.exr --stats reference.json
  lucerna render room.pbrt --resolution 160x120 --spp 4 --png --exposure -2
  lucerna render room.pbrt --png --white-balance 3000
  lucerna render room.pbrt --spp 1024 --denoise --part 3/16 -o part3.exr
  lucerna render watch.pbrt --colour-space acescg --png
  mpirun --hostfile machines --map-by ppr:1:node --bind-to none lucerna render room.pbrt --spp 1024 --png)";

// Frequent enough for a viewer who waits.
constexpr double kDisplayEvery = 1;  // seconds

struct RenderCommand {
    std::string scene;
    std::string output;
    bool png = false;
    std::string layers_asked;  // empty: no --layers; else "true" or names, one line per --layers
    bool layers = false;
    LayerNames chosen;            // of the layers; empty: all
    std::optional<bool> denoise;  // none: where it is useful
    std::optional<ImagePart> part;
    std::optional<PixelBox> crop;
    bool adaptive = true;  // if there are two halves
    PictureOptions picture;
    SceneOverrides overrides;
    RenderOptions options;
    CheckpointOptions checkpoint;
    std::optional<Endpoint> display;
    bool broadcast_scene = false;
    int passes = 0;  // 0: not given
    std::string stats;
    bool quiet = false;
};

// Returns the scene's image name in the current folder, as a scene file does not choose the folder. Parts of
// one image are rendered concurrently and get names of their own.
std::filesystem::path default_output(const FilmSettings& film, const std::optional<ImagePart>& part) {
    std::filesystem::path name = film.filename.filename().replace_extension(".exr");
    if (part)
        name.replace_filename(fmt::format("{}-part{}of{}.exr", name.stem().string(), part->number, part->of));
    return name;
}

void declare_image(const RenderCommand& command, const std::filesystem::path& image, CommandFiles& files) {
    files.writes(image, ".exr", "-o");
    if (command.png) files.writes(png_beside(image), ".png", "--png");
}

WorkingSpace parse_working_space(const std::string& word) {
    const auto colours = WorkingSpace::named(word);
    if (!colours) {
        throw InputError({"--colour-space"}, fmt::format("\"{}\" is unknown; expected {}", word,
                                                         fmt::join(WorkingSpace::names(), ", ")));
    }
    return *colours;
}

PixelBox parse_box(const Location& at, const std::string& word) {
    std::array<int, 4> edges{};
    std::istringstream in(word);
    std::string number, rest;
    bool whole = true;
    for (int& edge : edges) {
        if (!std::getline(in, number, ',')) whole = false;
        const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), edge);
        whole = whole && error == std::errc() && end == number.data() + number.size() && edge >= 0;
    }
    if (!whole || std::getline(in, rest) || edges[0] >= edges[2] || edges[1] >= edges[3]) {
        input_error(at,
                    "\"{}\" is not a rectangle; expected four whole numbers x0,y0,x1,y1 with x0 < x1 and y0 "
                    "< y1, for example 0,0,64,48",
                    one_line(word));
    }
    return {{edges[0], edges[1]}, {edges[2], edges[3]}};
}

ImagePart parse_part(const Location& at, const std::string& word) {
    constexpr int kMost = 1 << 20;
    const std::size_t slash = word.find('/');
    if (slash == word.npos)
        input_error(at, "\"{}\" is not a part; expected K/N, for example 3/16 for the third of sixteen",
                    one_line(word));
    const auto of = static_cast<int>(parse_whole(at, word.substr(slash + 1), 1, kMost));
    return {static_cast<int>(parse_whole(at, word.substr(0, slash), 1, of)), of};
}

// Rejects processes that srun starts without MPI, as each would render and write the same image.
void require_own_part(const RenderCommand& command) {
    const int processes = processes_without_mpi();
    if (processes > 1 && !command.part) {
        throw InputError(
            {"srun"},
            fmt::format("has started {} independent processes that would render the same image; use srun "
                        "--mpi=pmix to make them ranks of one render, or --ntasks=1, or a --part for each",
                        processes));
    }
}

// Requires parts of an image to have the same samples and method, whatever time each takes.
void require_part_of_a_picture(const RenderCommand& command) {
    if (!command.part) return;
    if (has_limit(command.options.limits)) {
        throw InputError({"--part"},
                         "all parts of a picture need the same number of samples; use --spp or --passes, not "
                         "--time or --error");
    }
    if (!command.options.maps.save.empty()) {
        throw InputError({"--part"},
                         "all parts would write the same maps; save them with --save-maps in a separate "
                         "render, and use --load-maps with all parts");
    }
}

// Declares the files that the command line names, before the scene names more.
void declare_files(const RenderCommand& command, CommandFiles& files) {
    files.reads(command.scene);
    if (!command.stats.empty()) files.writes(command.stats, "", "--stats");
    const MapFiles& maps = command.options.maps;
    if (!maps.save.empty()) {
        const bool points = suffix_of(maps.save) == kMapPointsSuffix;
        files.writes(maps.save, points ? kMapPointsSuffix : kMapsSuffix, "--save-maps");
    }
    if (!maps.load.empty()) {
        require_readable(maps.load);
        files.reads(maps.load);
    }
    const CheckpointOptions& checkpoint = command.checkpoint;
    if (!checkpoint.kept().empty()) {
        files.writes(checkpoint.kept(), "", checkpoint.save.empty() ? "--resume" : "--checkpoint");
        // The resumed checkpoint may be the one that is updated.
        if (!checkpoint.resume.empty() && !same_file(checkpoint.resume, checkpoint.kept()))
            files.reads(checkpoint.resume);
    }
    if (!command.output.empty()) declare_image(command, command.output, files);
}

// Returns false if the render stopped before any tile was done, as an empty image must not replace an earlier
// one.
bool has_light_or_is_whole(const RenderResult& result) {
    return result.report.complete || result.report.samples_done > 0 ||
           std::any_of(result.image.data.begin(), result.image.data.end(), [](float v) { return v != 0; });
}

// Returns the work after the render: denoising the light groups and writing the image.
LaterWork work_after_render(const RenderCommand& command, const Job& job) {
    constexpr std::size_t kOfImage = 6, kOfDenoised = 3;  // with the variance
    const FilmSettings& film = job.film;
    const std::size_t groups = film.parts ? job.scene.light_groups().names.size() : 0;
    std::size_t channels = kOfImage + 3 * groups;
    LaterWork work;
    if (film.two_halves) {
        channels += kOfDenoised + 3 * groups;
        if (film.parts) channels += 2 * kHalfChannels + kFeatureChannels;
        work.denoised = static_cast<double>(groups);
    }
    work.channels = static_cast<double>(channels);
    work.pictures = command.png ? 1 : 0;
    return work;
}

// Tells whether to show the denoised image by default: for a picture, or if time or error ends the render,
// but not with a checkpoint, where the command line alone determines what is rendered.
bool shows_denoised(const RenderCommand& command) {
    const bool asked_to_show = command.png || has_limit(command.options.limits);
    return command.denoise.value_or(asked_to_show && command.checkpoint.kept().empty());
}
bool denoises(const RenderCommand& command) {
    return command.layers || shows_denoised(command);
}

// Returns the chosen layers and the denoised image that is written without --layers.
LayerNames kept_layers(const RenderCommand& command) {
    LayerNames names = command.chosen;
    if (!names.empty() && shows_denoised(command))
        names.insert(names.end(), {"denoised.R", "denoised.G", "denoised.B"});
    return names;
}

// Tells whether the method may be chosen by timing, which makes a render irreproducible.
bool may_choose(const RenderCommand& command) {
    const SceneOverrides& asked = command.overrides;
    return has_limit(command.options.limits) && asked.integrator.empty() && asked.set.empty() &&
           asked.spp == 0 && command.passes == 0 && command.checkpoint.kept().empty() &&
           !command.options.maps.any();
}

// The files of an image.
class Pictures {
  public:
    // `attributes` are additional ones for the image's header.
    Pictures(const RenderCommand& command, std::filesystem::path image,
             std::map<std::string, std::string> attributes)
        : command_(command), image_(std::move(image)), attributes_(std::move(attributes)) {}

    const std::filesystem::path& image() const { return image_; }
    // Writes the image with the facts of the render as attributes, and returns the look of its picture, if
    // there is one. Modifies the image in place, because a copy may exceed the memory.
    std::optional<PictureLook> write(const RunFacts& facts, const Job& job, RenderResult& result) const {
        std::optional<PictureLook> look;
        if (command_.png) {
            const Image& picture = shown(result);
            look = command_.picture.look(picture);
            write_png(png_beside(image_), picture, *look, command_.options.workers);
        }
        // A part keeps all layers, as lucerna merge denoises the whole image and keeps the chosen layers.
        FileLayers layers{command_.layers || command_.part, command_.layers, {}};
        if (!command_.part) layers.chosen = kept_layers(command_);
        complete_image(facts, job, layers, command_.options.workers, result);
        result.image.attributes.insert(attributes_.begin(), attributes_.end());
        write_exr(image_, result.image, command_.options.workers.threads);
        return look;
    }
    // Returns lines on the written files for the user; `look` is that of write().
    std::vector<std::string> said(const RunFacts& facts, const RenderResult& result,
                                  const std::optional<PictureLook>& look) const {
        const RenderReport& report = result.report;
        const std::string passes =
            report.passes_done > 0 ? fmt::format("{} passes, ", report.passes_done) : "";
        std::vector<std::string> lines{
            fmt::format("image    {} ({} x {}, {}, {}{} spp, {}{})", image_.string(), result.image.width,
                        result.image.height, report.unit, passes, report.samples_done,
                        error_text(facts, report), duration_text(facts.render_seconds))};
        if (!report.pixels_apart.empty()) {
            const V2i& first = report.pixels_apart.front();
            lines.push_back(report.pixels_apart.size() == 1
                                ? fmt::format("note     pixel ({}, {}) sees a lamp smaller than a pixel; it "
                                              "is not included in the noise",
                                              first.x, first.y)
                                : fmt::format("note     {} pixels, the first ({}, {}), see a lamp smaller "
                                              "than a pixel; they are not included in the noise",
                                              report.pixels_apart.size(), first.x, first.y));
        }
        if (look) lines.push_back(picture_text(png_beside(image_), *look, result.image));
        return lines;
    }

  private:
    // A smaller share of an error changes it by less than a twentieth.
    static constexpr double kLeastStatedBlur = 0.3;

    static std::string error_text(const RunFacts& facts, const RenderReport& report) {
        if (!report.relative_error && !report.denoised_error) return "too few samples to tell the error, ";
        std::string text = report.relative_error
                               ? fmt::format("noise {}, ", percent_text(*report.relative_error))
                               : "too few samples to tell the noise, ";
        if (report.denoised_error) {
            const auto error = picture_error(facts, report);
            text += error ? fmt::format("denoised {}, ", percent_text(*error))
                          : "too few samples or pixels to tell the denoised image's error, ";
            if (error && report.blur.value_or(0) > kLeastStatedBlur * *error)
                text += fmt::format("{} of it by the blur of photons, ", percent_text(*report.blur));
        } else if (facts.choice && facts.choice->beyond_noise > 0) {
            text += fmt::format("up to {} in addition, ", percent_text(facts.choice->beyond_noise));
        }
        return text;
    }
    static const Image& shown(const RenderResult& result) {
        return result.denoised ? *result.denoised : result.image;
    }

    const RenderCommand& command_;
    std::filesystem::path image_;
    std::map<std::string, std::string> attributes_;
};

std::string stopped_text(const RenderReport& report, int asked) {
    return asked == kNoEndOfSamples
               ? fmt::format("stopped: {} samples per pixel were done", report.samples_done)
               : fmt::format("stopped: {} of {} samples per pixel were done", report.samples_done, asked);
}

// Appends the number of the frame to the file's name, except for the first frame.
std::filesystem::path of_frame(const std::filesystem::path& file, int frame) {
    if (file.empty() || frame == 1) return file;
    return file.parent_path() /
           fmt::format("{}-{}{}", file.stem().string(), frame, file.extension().string());
}

// Returns the command for a frame, which writes files of its own.
RenderCommand of_frame(const RenderCommand& command, int frame) {
    RenderCommand own = command;
    own.output = of_frame(command.output, frame).string();
    own.stats = of_frame(command.stats, frame).string();
    own.options.maps.save = of_frame(command.options.maps.save, frame);
    own.options.maps.load = of_frame(command.options.maps.load, frame);
    own.checkpoint.save = of_frame(command.checkpoint.save, frame);
    own.checkpoint.resume = of_frame(command.checkpoint.resume, frame);
    return own;
}

// State that the frames of one scene file share.
struct Frames {
    SceneFrames scene;
    CommandFiles files;                       // of all frames so far
    std::set<std::filesystem::path> written;  // images of earlier frames
    ConsoleMonitor& monitor;
    const CommandContext& context;
    Ranks* ranks;     // null for a single process
    SceneCopy* copy;  // null: every rank reads the files itself

    bool leads() const { return !ranks || ranks->leads(); }
};

// Returns the next frame of the scene file, if one is left, as the command line has it rendered.
std::optional<Job> next_job(const RenderCommand& command, SceneFrames& scene) {
    std::optional<Job> job = scene.next();
    if (!job) return job;
    require_layers({"--layers"}, command.chosen, *job);
    RenderRequest request;
    request.passes = command.passes;
    request.spp = command.overrides.spp;
    request.crop = command.crop;
    request.denoise = denoises(command);
    // No part of a picture knows which pixels of the picture need most samples.
    request.adaptive = command.adaptive && !command.part;
    request.layers = command.layers;
    apply(request, command.options.limits, *job);
    if (command.part) restrict_to(*command.part, job->film);
    return job;
}

// With --broadcast-scene rank 0 sends the files of a frame that it has read, or of no frame.
void send_files(const RenderCommand& command, const Frames& frames, const std::optional<Job>& job) {
    if (!frames.copy || !frames.leads()) return;
    std::vector<std::filesystem::path> all = job ? job->files : std::vector<std::filesystem::path>();
    if (job) all.insert(all.end(), job->caches.begin(), job->caches.end());
    frames.copy->send({command.scene, command.options.maps.load}, std::move(all));
}

// With --broadcast-scene the other ranks get the files of a frame before they read it.
void receive_files(RenderCommand& command, SceneCopy* copy) {
    const SceneCopy::Places places = copy->receive();
    command.scene = places.scene.string();
    command.options.maps.load = places.maps;
}

// Returns the image that the frame writes, and declares the files of the job; at rank 0.
std::filesystem::path declare_frame(const RenderCommand& command, Frames& frames, int frame, const Job& job) {
    std::filesystem::path image = command.output.empty() ? default_output(job.film, command.part)
                                                         : std::filesystem::path(command.output);
    while (!frames.written.insert(image).second) image = of_frame(image, frame);
    if (command.output.empty()) declare_image(command, image, frames.files);
    frames.files.reads(job.files);
    frames.files.reads(job.caches);
    return image;
}

// Writes what was rendered, and says so; at rank 0.
void write_result(const RenderCommand& command, const Pictures& pictures, const RunFacts& facts,
                  const Job& job, RenderResult& result, Monitor& monitor) {
    const bool keep = has_light_or_is_whole(result);
    std::vector<std::string> said;
    if (keep) {
        const std::optional<PictureLook> look = pictures.write(facts, job, result);
        for (std::string& line : pictures.said(facts, result, look)) said.push_back(std::move(line));
    } else {
        said.push_back("no image written: nothing has been rendered yet");
    }
    if (!command.stats.empty()) {
        const auto kept = keep ? pictures.image() : std::filesystem::path();
        write_text(command.stats, statistics_json(facts, job, result.report, kept));
        said.push_back(fmt::format("numbers  {}", command.stats));
    }
    if (!command.checkpoint.kept().empty())
        said.push_back(fmt::format("continue --resume {}", command.checkpoint.kept().string()));
    for (const std::string& line : said) monitor.info(line);
}

// Writes an image on the way. A failure may be over later, and the render is worth more.
void show_result(const RenderCommand& command, const Pictures& pictures, const RunFacts& facts,
                 const Job& job, RenderResult shown, Monitor& monitor) {
    try {
        pictures.write(facts, job, shown);
        if (!command.stats.empty())
            write_text(command.stats, statistics_json(facts, job, shown.report, pictures.image()));
    } catch (const InputError& error) {
        monitor.warn(fmt::format("--show-every: {}; the render continues", error.what()));
    }
}

// Renders a frame that was read, and at rank 0 shows and writes it. `clock` runs since the frame's time
// began. Returns whether the user wants the frames after it.
bool render_job(const RenderCommand& command, Frames& frames, Job& job, const std::filesystem::path& image,
                RunFacts& facts, Checkpointing& checkpointing, const Stopwatch& clock) {
    ConsoleMonitor& monitor = frames.monitor;
    std::map<std::string, std::string> attributes;
    if (command.part)
        attributes = part_attributes(*command.part, job, facts.seed, command.layers, kept_layers(command));
    const Pictures pictures(command, image, std::move(attributes));
    RenderOptions options = command.options;
    options.workers.ranks = frames.ranks;
    options.limits.seconds = command.options.limits.seconds - clock.seconds();
    options.later = work_after_render(command, job);
    const Stopwatch rendering;
    checkpointing.attach(job, options);
    const auto note = [&] {
        facts.render_seconds = checkpointing.earlier_seconds() + rendering.seconds() - facts.choose_seconds;
        facts.warnings = monitor.warnings();
    };
    options.show = [&](const RenderResult& result) {
        note();
        show_result(command, pictures, facts, job, result, monitor);
    };
    std::optional<TevDisplay> display;
    if (command.display && frames.leads()) {
        display.emplace(*command.display, pictures.image().filename().string(), monitor);
        options.watch_every = kDisplayEvery;
        options.watch = [&display](const RenderResult& result) { display->show(result.image); };
    }
    RenderResult result = may_choose(command) ? render_by_choice(job, options, facts, monitor)
                                              : render_as_asked(job, options, monitor);
    if (frames.leads()) {
        note();
        write_result(command, pictures, facts, job, result, monitor);
        checkpointing.finish();
    }
    const bool go_on = agreed(options.workers, result.report.complete && !monitor.stopped());
    if (!result.report.complete) throw Stopped(stopped_text(result.report, job.spp));
    return go_on;
}

// Reads and renders the next frame of the scene file, if one is left; on all ranks of a job. `clock` runs
// since the frame's time began. Returns whether the user wants the frames after it.
bool render_frame(const RenderCommand& command, Frames& frames, int frame, const Stopwatch& clock) {
    Checkpointing checkpointing(frames.leads() ? command.checkpoint : CheckpointOptions(), frames.monitor);
    RunFacts facts{command.scene, command.options.seed, command.options.workers.threads};
    const Stopwatch reading;
    std::optional<Job> job = next_job(command, frames.scene);
    send_files(command, frames, job);
    if (!job) return false;
    facts.read_seconds = reading.seconds();
    std::filesystem::path image;
    if (frames.leads()) image = declare_frame(command, frames, frame, *job);
    // From here on there is something to keep; a signal is rank 0's to heed.
    const StopOnSignals listening(frames.context.process);
    if (frames.ranks)
        require_same_facts(*frames.ranks, "render a different picture", picture_facts(*job, facts.seed));
    return render_job(command, frames, *job, image, facts, checkpointing, clock);
}

// Renders all frames of the scene file, on all ranks of a job; the others than rank 0 print nothing.
void render_frames(RenderCommand command, const CommandContext& context, Ranks* ranks, Stopwatch clock) {
    const bool leads = !ranks || ranks->leads();
    require_own_part(command);
    require_part_of_a_picture(command);
    std::optional<SceneCopy> copy;
    if (ranks && command.broadcast_scene) copy.emplace(*ranks);
    if (copy && !leads) receive_files(command, &*copy);
    require_readable(command.scene);
    CommandFiles files;
    if (leads) declare_files(command, files);
    std::ostream nowhere(nullptr);
    ConsoleMonitor monitor(leads ? context.out : nowhere, leads ? context.err : nowhere,
                           {leads && context.process.terminal,
                            command.quiet || !leads,
                            leads ? context.process.stop : nullptr,
                            {}});
    Frames frames{SceneFrames(command.scene, command.overrides, command.options.workers, monitor),
                  std::move(files),
                  {},
                  monitor,
                  context,
                  ranks,
                  copy ? &*copy : nullptr};
    bool go_on = render_frame(command, frames, 1, clock);
    for (int frame = 2; go_on && frames.scene.more(); ++frame) {
        clock = {};
        RenderCommand own = of_frame(command, frame);
        if (copy && !leads) receive_files(own, &*copy);
        if (leads) declare_files(own, frames.files);
        go_on = render_frame(own, frames, frame, clock);
    }
}

void act(const RenderCommand& command, const CommandContext& context) {
    const Stopwatch clock;
    const ParallelJob parallel(context, command.options.workers);
    parallel.run([&] { render_frames(command, context, parallel.ranks(), clock); });
}

void add_image_options(CLI::App& app, RenderCommand& command) {
    app.add_option("SCENE", command.scene, "scene file in pbrt's text format")
        ->required()
        ->type_name("SCENE.pbrt");
    app.add_option("-o,--output", command.output,
                   "OpenEXR image (default: the file name in the scene file, in the current folder)")
        ->type_name("FILE.exr");
    app.add_flag_callback(
        "--denoise", [&command] { command.denoise = true; },
        "also write a denoised image (default with --png, --time and --error)");
    app.add_flag_callback(
           "--no-denoise", [&command] { command.denoise = false; }, "do not denoise")
        ->excludes("--denoise");
    app.add_flag("--layers", command.layers_asked,
                 "write additional layers: light by kind and by light group, features of the first visible "
                 "surface, and the data for denoising; --layers=NAME,NAME writes only these, for example "
                 "--layers=direct,lightgroup,albedo; see docs/reference/layers.md")
        ->multi_option_policy(CLI::MultiOptionPolicy::Join)
        ->excludes("--no-denoise");
    app.add_flag_callback(
        "--no-adaptive", [&command] { command.adaptive = false; },
        "use the same number of samples for every pixel (default: adaptive if the image is denoised)");
    app.add_flag("--png", command.png, "also write a tone-mapped picture beside the image");
    add_picture_options(app, command.picture);
    add_word(app, "--resolution", "WxH", "image size in pixels (default: from the scene)",
             [&command](const std::string& word) {
                 command.overrides.resolution = parse_size({"--resolution"}, word, 65536);
             });
    add_word(app, "--crop", "X0,Y0,X1,Y1",
             "render only this rectangle, in pixels from the top left; X1 and Y1 are excluded",
             [&command](const std::string& word) { command.crop = parse_box({"--crop"}, word); });
    add_word(app, "--part", "K/N", "render the K-th of N parts of the picture, for lucerna merge",
             [&command](const std::string& word) { command.part = parse_part({"--part"}, word); });
    add_word(app, "--colour-space", "NAME",
             fmt::format("colour space of the render and of the image: {} (default: from the scene)",
                         fmt::join(WorkingSpace::names(), ", ")),
             [&command](const std::string& word) { command.overrides.colours = parse_working_space(word); });
    add_unit_option(app, command.overrides.unit);
    app.add_flag(
        "--broadcast-scene", command.broadcast_scene,
        "only the first rank of a parallel job reads the scene's files and sends them to the others");
    app.add_flag("--skip-missing", command.overrides.skip_missing,
                 "leave out meshes and textures whose file does not exist, with a warning");
    app.add_flag(
        "--strict", command.overrides.strict,
        "stop with an error, instead of a warning, if part of the scene cannot be rendered as specified");
    app.add_option("--stats", command.stats, "write times, counts and settings as JSON")
        ->type_name("FILE.json");
    app.add_flag("--quiet", command.quiet, "print warnings and errors only");
}

void add_map_options(CLI::App& app, RenderCommand& command) {
    app.add_option(
           "--save-maps", command.options.maps.save,
           "save the photon maps, for other views of the same scene (FILE.photons), or as points with "
           "position, direction and power for other programs (FILE.ply) (photonmap)")
        ->type_name("FILE.photons|.ply");
    app.add_option(
           "--load-maps", command.options.maps.load,
           "load the photon maps from this file; geometry, materials, lights, seed and settings of the light "
           "paths must be those of --save-maps")
        ->type_name("FILE.photons")
        ->excludes("--save-maps");
}

void add_live_options(CLI::App& app, RenderCommand& command) {
    add_word(app, "--show-every", "TIME",
             "write image, picture and statistics at this interval while rendering",
             [&command](const std::string& word) {
                 command.options.show_every = parse_duration({"--show-every"}, word);
             });
    add_word(
        app, "--display", "HOST:PORT",
        fmt::format("show the image while it converges in a running tev viewer (default port {})", kTevPort),
        [&command](const std::string& word) {
            command.display = parse_endpoint({"--display"}, word, kTevPort);
        });
    app.add_option("--checkpoint", command.checkpoint.save,
                   "save the state of the render to this file, at intervals and at the end")
        ->type_name("FILE");
    add_word(app, "--checkpoint-every", "TIME", "interval of --checkpoint (default 30s)",
             [&command](const std::string& word) {
                 command.checkpoint.every = parse_duration({"--checkpoint-every"}, word);
             });
    app.add_option("--resume", command.checkpoint.resume,
                   "continue from this checkpoint, and update it unless --checkpoint names another file")
        ->type_name("FILE");
}

void add_limit_options(CLI::App& app, RenderCommand& command) {
    add_word(app, "--passes", "N", "number of passes, for an integrator that works in passes (progressive)",
             [&command](const std::string& word) {
                 command.passes = static_cast<int>(parse_whole({"--passes"}, word, 1, kNoEndOfSamples));
             });
    add_word(app, "--time", "TIME", "stop after this time, for example 30s, 5min, 2h",
             [&command](const std::string& word) {
                 command.options.limits.seconds = parse_duration({"--time"}, word);
             });
    add_word(app, "--error", "SHARE",
             "stop when the remaining error is no larger than this, for example 1% or 0.01",
             [&command](const std::string& word) {
                 command.options.limits.error = parse_share({"--error"}, word);
             });
}

void add_method_options(CLI::App& app, RenderCommand& command) {
    app.add_option("--integrator", command.overrides.integrator,
                   fmt::format("one of {}", fmt::join(integrator_names(), ", ")))
        ->type_name("NAME");
    app.add_option_function<std::vector<std::string>>(
           "--set",
           [&command](const std::vector<std::string>& words) {
               for (const std::string& word : words) {
                   command.overrides.set.push_back(parse_assignment({"--set"}, word));
               }
           },
           "set a parameter of the integrator; may be repeated")
        ->type_name("KEY=VALUE")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    add_word(app, "--spp", "N", "samples per pixel (default: from the scene)",
             [&command](const std::string& word) {
                 command.overrides.spp = static_cast<int>(parse_whole({"--spp"}, word, 1, 1 << 24));
             });
    add_limit_options(app, command);
    add_word(app, "--seed", "N", "seed of the random numbers (default 0); the same seed gives the same image",
             [&command](const std::string& word) { command.options.seed = parse_seed({"--seed"}, word); });
    add_threads(app, command.options.workers);
}

}  // namespace

void add_render_command(CLI::App& program, const CommandContext& context) {
    const auto command = std::make_shared<RenderCommand>();
    CLI::App& app = *program.add_subcommand("render", "Render a scene file into an OpenEXR image");
    app.footer(kRenderFooter);
    add_image_options(app, *command);
    add_method_options(app, *command);
    add_map_options(app, *command);
    add_live_options(app, *command);
    app.callback([command, &context] {
        command->overrides.output = command->output;
        command->layers = !command->layers_asked.empty();
        command->chosen = parse_layers(command->layers_asked);
        act(*command, context);
    });
}

}  // namespace lucerna
