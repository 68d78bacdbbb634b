// lucerna light acquire: measures a lamp on the virtual measuring bench.
#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <filesystem>
#include <functional>
#include <memory>
#include <new>
#include <optional>

#include "engine/base/error.h"
#include "engine/base/version.h"
#include "engine/cli/command_files.h"
#include "engine/cli/commands.h"
#include "engine/cli/light/acquire_scene.h"
#include "engine/cli/light/lamp_text.h"
#include "engine/cli/light/light_commands.h"
#include "engine/cli/light/quick_lamp.h"
#include "engine/cli/light/scene_lamp.h"
#include "engine/cli/parallel_job.h"
#include "engine/scene/arithmetic.h"
#include "engine/scene/texture_image.h"
#include "engine/system/files.h"
#include "engine/system/hash.h"
#include "lights/measurement/acquire.h"
#include "lights/measurement/camera_simulation.h"
#include "lights/measurement/join_sides.h"
#include "lights/measurement/rig_file.h"

namespace lucerna {
namespace {

constexpr const char* kAcquireFooter =
    R"(RIG.toml describes the measuring rig and the lamp in front of it: a disc, a rectangle, a slide projector or a scene; see
docs/reference/rig-files.md. Without it the options describe a flat emitter whose intensity falls off as cos^N, and
suitable planes are chosen.

--scene LUMINAIRE.pbrt needs no rig: all light paths of a luminaire are traced, from its lights, which may be ray files and
light fields of LEDs, over its reflectors, lenses and louvres. The rays that leave it become a lamp as lucerna light import
makes it, with the errors that held-out rays state. What each material absorbs is printed. The lamp's frame is the scene's
world, in metres; lucerna import turns a glTF model into a scene.

With --filter none the lamp is measured without the optical filter, through a pinhole at each filter
position, and the field is interpolated linearly: a canned light source [Heidrich 1998]. Details finer than
the spacing are then aliased, whereas the filter blurs them.
With --sides a luminaire that emits towards several sides is turned in front of the rig; the light fields of its sides
form one lamp, and light that is in two of them is divided between them by its direction.

An acquisition that is stopped (Ctrl-C) or killed leaves LAMP.exr.part; the same command continues from there.

Under mpirun or srun --mpi=pmix the ranks share the work, and the result is the same, bit for bit, as with one process;
rank 0 writes the files. All ranks read the rig and its scene.

Examples:
  lucerna light acquire scenes/lamps/projector/rig.toml -o lamp.exr
  lucerna light acquire RIG.toml -o lamp.exr --photographs FOLDER
  lucerna light acquire scenes/lamps/projector/rig.toml --filter none -o canned.exr
  lucerna light acquire RIG.toml --sides +z,-z,+x,-x,+y,-y -o lamp.exr
  lucerna light acquire --scene luminaire.pbrt --rays 10000000 -o lamp.exr
  lucerna light acquire --scene downlight.pbrt --sides +z --rays 1000000 -o lamp.exr
  lucerna light acquire -o lamp.exr
  lucerna light acquire --radius 25mm --flux 1500 --unit lm -o lamp.exr
  lucerna light acquire --emitter rectangle --size 20mmx10mm --exponent 8 --flux 3 --pixels 96x96 -o lamp.exr)";

struct AcquireCommand {
    std::string rig;         // a file; empty: the scene of a luminaire, or the quick lamp
    SceneLampOptions scene;  // its file is empty without --scene
    QuickLamp quick;
    std::string photographs;      // a folder; empty: none are written
    std::vector<SlabAxes> sides;  // measured sides of a scene; none: +z
    bool strict = false;          // for the scene that the rig names
    bool filter = true;
    LampOutput lamp;
};

// An analytic lamp, and a hash of everything that determines its measurement.
struct NamedEmitter {
    EmitterModel model;
    std::uint64_t key = 0;
};

EmitterModel flat_emitter(const EmitterDescription& from) {
    const bool disc = from.kind == EmitterDescription::Kind::disc;
    EmitterModel model = cosine_emitter(disc ? EmitterModel::Outline::disc : EmitterModel::Outline::rectangle,
                                        from.half_size, from.flux, from.exponent);
    model.setback = from.setback;
    model.info.provenance =
        disc ? fmt::format("virtual acquisition of a disc of radius {}", length_text(from.half_size.x))
             : fmt::format("virtual acquisition of a rectangle of {} x {}", length_text(2 * from.half_size.x),
                           length_text(2 * from.half_size.y));
    model.info.provenance += fmt::format(", cos^{:g}", from.exponent);
    set_colours(model, {from.colour, from.rim_colour, from.grazing_colour});
    return model;
}

Projector projector_of(const EmitterDescription& from) {
    Projector projector;
    projector.aperture = from.half_size.x;
    projector.focal_length = from.focal_length;
    projector.focus = from.focus;
    projector.setback = from.setback;
    projector.slide_size = from.slide_size;
    projector.inverted = from.inverted;
    projector.flux = from.flux;
    projector.colour = from.colour;
    return projector;
}

NamedEmitter emitter_of(const RigDescription& description, Monitor& monitor) {
    const EmitterDescription& from = description.emitter;
    NamedEmitter emitter;
    WordHash key;  // of the description, its slide and the program
    key.add(description_key(description));
    if (from.kind == EmitterDescription::Kind::projector) {
        const std::shared_ptr<const Image> slide =
            read_texture_image(from.slide, {}, [&monitor](const std::string& text) { monitor.warn(text); });
        emitter.model =
            naming(from.slide.string(), [&] { return projector_emitter(projector_of(from), *slide); });
        key.add(slide->width);
        for (const float x : slide->data) key.add(x);
    } else {
        emitter.model = flat_emitter(from);
    }
    key.add(program_version());
    key.add(arithmetic());
    emitter.key = key.value();
    emitter.model.info.unit = from.unit;
    emitter.model.info.provenance +=
        fmt::format(", {:g} {}; lucerna {}", from.flux, flux_unit_name(from.unit), program_version());
    return emitter;
}

void require_same_emitter(const Workers& workers, const NamedEmitter& emitter) {
    if (!workers.ranks) return;
    require_same_facts(*workers.ranks, "measure a different lamp",
                       {{"description (hash of it)", fmt::format("{:016x}", emitter.key)}});
}

// Runs `work`. Removes the file of unfinished work after an error in the description, because the same
// command would fail again and the file would block the corrected one. Keeps it after a full disk or a stop
// by the user.
template <typename Work>
auto giving_up_part(const std::filesystem::path& part, Work&& work) {
    try {
        return work();
    } catch (const Stopped&) {
        throw;
    } catch (const WriteError&) {
        throw;
    } catch (const InputError&) {
        std::error_code none;
        std::filesystem::remove(part, none);
        throw;
    }
}

struct AcquireWork {
    std::filesystem::path part;  // file of unfinished work; empty except at rank 0
    Workers workers;
    bool strict = false;                            // of a scene
    SlabAxes side;                                  // of a scene
    std::function<void(const Job& job)> when_read;  // of a scene
};

// Simulates the sensor, and continues unfinished work from its file.
FilterImages acquire_formula(const RigDescription& description, const AcquireWork& work, Monitor& monitor) {
    const std::filesystem::path& part_file = work.part;
    const NamedEmitter emitter = emitter_of(description, monitor);
    require_same_emitter(work.workers, emitter);
    std::optional<AcquirePart> part;
    if (!part_file.empty()) part.emplace(part_file, emitter.key);
    if (part && part->columns() > 0)
        monitor.info(fmt::format("{}: continuing after {} columns", part_file.string(), part->columns()));
    AcquireOptions options = description.quality;
    options.part = part ? &*part : nullptr;
    try {
        return giving_up_part(part_file, [&] {
            return acquire_filters(emitter.model, description.rig, work.workers, monitor, options);
        });
    } catch (const std::bad_alloc&) {  // thrown before any work, so nothing is worth keeping
        std::error_code none;
        if (part && part->columns() == 0) std::filesystem::remove(part_file, none);
        throw;
    } catch (const Stopped& stopped) {
        throw Stopped(
            fmt::format("{}; the same command continues from {}", stopped.what(), part_file.string()));
    }
}

// Traces a luminaire with the engine and prints its flux balance.
FilterImages acquire_luminaire(const RigDescription& description, const AcquireWork& work, Monitor& monitor) {
    const EmitterDescription& from = description.emitter;
    SceneEmitter emitter{from.scene, from.rays, from.seed, from.unit, from.flux};
    emitter.strict = work.strict;
    emitter.side = work.side;
    emitter.when_read = work.when_read;
    SceneAcquisition made = acquire_scene(emitter, description.rig, work.part, work.workers, monitor);
    if (work.workers.ranks && !work.workers.ranks->leads()) return std::move(made.images);
    const std::string_view unit = flux_unit_name(from.unit);
    const FluxAccount& account = made.account;
    monitor.info(
        fmt::format("its lights emit {:.4g} {}; {:.4g} leave the luminaire: {:.4g} backwards, {:.4g} beside "
                    "S, {:.4g} beside M, {:.4g} in the field",
                    made.emitted, unit, account.total, account.backward, account.beside_s, account.beside_m,
                    account.captured));
    monitor.info(fmt::format("noise of the coefficients {:.3g} % in total", 100 * made.noise.relative));
    made.images.info.provenance += fmt::format("; lucerna {}", program_version());
    return std::move(made.images);
}

FilterImages acquire_images(const RigDescription& description, const AcquireWork& work, Monitor& monitor) {
    if (description.emitter.kind == EmitterDescription::Kind::scene)
        return acquire_luminaire(description, work, monitor);
    return acquire_formula(description, work, monitor);
}

// Distributes the images of rank 0.
void share_images(Ranks& ranks, FilterImages& images) {
    Packer packer;
    if (ranks.leads()) images.fields(packer);
    const std::vector<std::byte> bytes = ranks.broadcast("filter images", packer.take());
    if (ranks.leads()) return;
    Unpacker unpacker(bytes);
    images.fields(unpacker);
}

// Returns the file of a side's unfinished work.
std::filesystem::path part_of(const AcquireCommand& command, const SlabAxes& side) {
    return command.lamp.file + (side.straight() ? "" : "." + side.name()) + ".part";
}

void declare_files(const AcquireCommand& command, const RigDescription& description,
                   const std::vector<SlabAxes>& sides, CommandFiles& files) {
    for (const std::filesystem::path& file :
         {std::filesystem::path(command.rig), description.emitter.slide, description.emitter.scene}) {
        if (!file.empty()) files.reads(file);
    }
    declare_lamp(command.lamp.file, "-o", files);
    if (!command.photographs.empty())
        files.writes_into(command.photographs, "--photographs", is_photographs_name);
    if (command.filter)
        for (const SlabAxes& side : sides) files.writes_beside(part_of(command, side), "-o");
    if (!command.photographs.empty())
        check_photographs(description.rig, description.camera.value_or(CameraModel()), command.photographs);
}

// Measures through pinholes, without a filter.
LightField acquire_canned(const RigDescription& description, const Workers& workers, Monitor& monitor) {
    const NamedEmitter emitter = emitter_of(description, monitor);
    require_same_emitter(workers, emitter);
    EmitterModel model = emitter.model;
    model.info.provenance += "; without an optical filter";
    return acquire_without_filter(model, description.rig, workers, monitor, description.quality);
}

void check_filter(const RigDescription& description, const AcquireCommand& command) {
    if (command.filter) return;
    if (description.emitter.kind == EmitterDescription::Kind::scene) {
        throw InputError({"--filter"},
                         "none works with a disc, a rectangle or a projector only; the light of a scene is "
                         "measured behind a filter");
    }
    if (!command.photographs.empty() || description.camera) {
        throw InputError(
            {"--filter"},
            "none cannot be combined with a camera or --photographs, which simulate the filters");
    }
}

void check_sides(const AcquireCommand& command, const RigDescription& description) {
    if (command.sides.empty()) return;
    require_different_sides("--sides", command.sides);
    if (description.emitter.kind != EmitterDescription::Kind::scene) {
        throw InputError({"--sides"},
                         "a disc, a rectangle and a projector emit towards +z only; expected a rig whose "
                         "emitter is a scene");
    }
    if (!command.photographs.empty())
        throw InputError({"--photographs"}, "are those of a single side; cannot be combined with --sides");
}

// Rejects --strict without a scene, where it would have no effect.
void refuse_strict_without_scene(const AcquireCommand& command, const RigDescription& description) {
    if (!command.strict || description.emitter.kind == EmitterDescription::Kind::scene) return;
    throw InputError({"--strict"}, "applies only to a rig whose emitter is a scene");
}

// Messages and requests to stop: in a parallel job rank 0 prints, and all ranks stop at the same places.
class Speaker {
  public:
    Speaker(const AcquireCommand& command, const CommandContext& context, Ranks* ranks)
        : leads_(!ranks || ranks->leads()),
          console_(
              leads_ ? context.out : nowhere_, leads_ ? context.err : nowhere_,
              leads_ ? console_settings(command.lamp, context) : ConsoleSettings{false, true, nullptr, {}}) {
        if (!ranks) return;
        ranks->listen_to([this] { return console_.stopped(); });
        of_all_.emplace(*ranks, console_);
    }
    bool leads() const { return leads_; }
    ConsoleMonitor& console() { return console_; }
    Monitor& monitor() { return of_all_ ? static_cast<Monitor&>(*of_all_) : console_; }

  private:
    bool leads_;
    std::ostream nowhere_{nullptr};
    ConsoleMonitor console_;
    std::optional<RanksMonitor> of_all_;
};

// Returns the images through the camera of the description, if any; rank 0 writes its photographs if
// requested.
FilterImages through_camera(FilterImages images, const RigDescription& description,
                            const AcquireCommand& command, const Workers& workers, Speaker& speaker) {
    const CameraModel camera = description.camera.value_or(CameraModel());
    Ranks* const ranks = workers.ranks;
    if (!command.photographs.empty()) {
        try {
            if (speaker.leads())
                write_photographs(images, camera, command.photographs, workers.alone(), speaker.console());
        } catch (const Stopped&) {
            if (!ranks) throw;
        }
        if (ranks && ranks->agree_to_stop()) throw Stopped("photographs: stopped");
    }
    if (!description.camera) return images;
    if (ranks) share_images(*ranks, images);
    return photographed(images, camera, workers, speaker.monitor()).images;
}

void acquire_lamp(const AcquireCommand& command, const CommandContext& context, Ranks* ranks) {
    const RigDescription description =
        command.rig.empty() ? describe(command.quick) : read_rig_file(command.rig);
    refuse_strict_without_scene(command, description);
    check_filter(description, command);
    check_sides(command, description);
    const std::vector<SlabAxes> sides = command.sides.empty() ? std::vector{SlabAxes{}} : command.sides;
    Speaker speaker(command, context, ranks);
    CommandFiles files;
    if (speaker.leads()) declare_files(command, description, sides, files);
    Monitor& monitor = speaker.monitor();
    std::optional<StopOnSignals> listening;
    AcquireWork work{{}, {command.lamp.workers.threads, ranks}, command.strict, {}, [&](const Job& job) {
                         files.reads(job.files);
                         files.reads(job.caches);
                         if (!listening) listening.emplace(context.process);
                     }};
    if (description.emitter.kind != EmitterDescription::Kind::scene) listening.emplace(context.process);
    if (!command.filter) {
        LightField canned = acquire_canned(description, work.workers, monitor);
        if (speaker.leads()) finish_lamp(std::move(canned), command.lamp, speaker.console(), context);
        return;
    }
    std::vector<Slab> measured;
    for (const SlabAxes& side : sides) {
        if (speaker.leads()) work.part = part_of(command, side);
        work.side = side;
        if (sides.size() > 1) monitor.info(fmt::format("side {}:", side.name()));
        FilterImages seen = acquire_images(description, work, monitor);
        giving_up_part(work.part, [&] {
            seen = through_camera(std::move(seen), description, command, work.workers, speaker);
            if (speaker.leads()) measured.push_back({side, field_of(seen)});
        });
    }
    if (!speaker.leads()) return;
    giving_up_part(part_of(command, sides[0]), [&] {
        finish_lamp(join_sides(std::move(measured)), command.lamp, speaker.console(), context);
    });
    std::error_code none;
    for (const SlabAxes& side : sides) std::filesystem::remove(part_of(command, side), none);
}

// Traces a luminaire without a rig.
void acquire_luminaire_lamp(const AcquireCommand& command, const CommandContext& context, Ranks* ranks) {
    SceneLampOptions options = command.scene;
    if (const std::string suffix = suffix_of(options.file); suffix == ".gltf" || suffix == ".glb") {
        input_error({"--scene"}, "{} is a glTF model; expected a scene, which lucerna import makes of it",
                    options.file.string());
    }
    require_readable(options.file);
    require_different_sides("--sides", command.sides);
    options.strict = command.strict;
    options.lumigraph.sides = command.sides;
    Speaker speaker(command, context, ranks);
    CommandFiles files;
    files.reads(options.file);
    if (speaker.leads()) declare_lamp(command.lamp.file, "-o", files);
    std::optional<StopOnSignals> listening;
    options.when_read = [&](const Job& job) {
        files.reads(job.files);
        files.reads(job.caches);
        listening.emplace(context.process);
    };
    const std::optional<SceneLamp> made =
        make_scene_lamp(options, {command.lamp.workers.threads, ranks}, speaker.monitor());
    if (!made) return;
    finish_lamp(made->fit.lamp, command.lamp, speaker.console(), context);
    if (command.lamp.quiet) return;
    print_account(context.out, made->account);
    print_fit(context.out, made->fit);
}

void act_acquire(const AcquireCommand& command, const CommandContext& context) {
    const ParallelJob parallel(context, command.lamp.workers);
    parallel.run([&] {
        const auto acquire = command.scene.file.empty() ? acquire_lamp : acquire_luminaire_lamp;
        acquire(command, context, parallel.ranks());
    });
}

// Rejects options that would be ignored. `accepted` are those that are not, beside the output's.
void refuse_options(const CLI::App& app, std::initializer_list<std::string_view> accepted,
                    const std::string& because) {
    constexpr std::string_view kAlways[] = {"--output",  "--strict", "--sides",
                                            "--threads", "--quiet",  "--help"};
    for (const CLI::Option* option : app.get_options()) {
        const std::string name = option->get_name();
        const auto is = [&](std::string_view other) { return name == other; };
        if (option->count() == 0 || std::ranges::any_of(kAlways, is) || std::ranges::any_of(accepted, is))
            continue;
        throw InputError({name}, because);
    }
}

void check_options(const CLI::App& app, AcquireCommand& command) {
    const QuickLamp& quick = command.quick;
    if (!command.rig.empty()) {
        return refuse_options(
            app, {"RIG", "--photographs", "--filter"},
            fmt::format("applies only without a rig file; {} describes the rig and the lamp", command.rig));
    }
    if (command.scene.file.empty()) {
        for (const char* name : {"--rays", "--seed"}) {
            if (app.get_option(name)->count() > 0) throw InputError({name}, "applies only to --scene");
        }
        return;
    }
    refuse_options(
        app,
        {"--scene", "--rays", "--seed", "--flux", "--unit", "--views", "--pixels", "--distance", "--capture"},
        fmt::format("does not apply to --scene {}", command.scene.file.string()));
    if (app.get_option("--flux")->count() > 0) command.scene.flux = quick.flux;
    if (app.get_option("--unit")->count() > 0) {
        if (quick.unit != "lm" && quick.unit != "W")
            input_error({"--unit"}, "\"{}\" is not accepted; expected lm or W", quick.unit);
        command.scene.unit = quick.unit == "lm" ? FluxUnit::lumen : FluxUnit::watt;
    }
    FitOptions& fit = command.scene.lumigraph.fit;
    if (app.get_option("--views")->count() > 0) fit.views = quick.views;
    if (app.get_option("--pixels")->count() > 0) fit.pixels = quick.pixels;
    fit.distance = quick.distance;
    if (app.get_option("--capture")->count() > 0) fit.capture = quick.capture;
}

}  // namespace

void add_light_acquire(CLI::App& light, const CommandContext& context) {
    const auto command = std::make_shared<AcquireCommand>();
    CLI::App& app = *light.add_subcommand("acquire", "Measure a lamp on a virtual rig, or trace a luminaire");
    app.footer(kAcquireFooter);
    app.add_option("RIG", command->rig, "description of the rig and the lamp")->type_name("RIG.toml");
    app.add_option("--scene", command->scene.file,
                   "luminaire, with lights, reflectors and lenses, that is traced without a rig")
        ->type_name("SCENE.pbrt");
    add_word(app, "--rays", "N", "light paths of --scene (default 4000000)",
             [command](const std::string& word) {
                 command->scene.paths = parse_whole({"--rays"}, word, 1, std::int64_t{1} << 32);
             });
    add_word(app, "--seed", "N", "seed of the random numbers of --scene (default 0)",
             [command](const std::string& word) { command->scene.seed = parse_seed({"--seed"}, word); });
    app.add_option(
           "--photographs", command->photographs,
           "also write the photographs that the rig's camera would take, and a manifest for light assemble")
        ->type_name("FOLDER");
    add_word(
        app, "--sides", "AXIS,...",
        "for a scene that emits towards several sides, for example +z,-z,+x: it is turned, and each "
        "side is measured with this rig; with --scene, the sides that get a light field (default: as many as "
        "hold 99% of the light)",
        [command](const std::string& word) {
            command->sides =
                parse_list(word, [](std::string_view part) { return parse_side("--sides", part); });
        });
    app.add_flag(
        "--strict", command->strict,
        "stop with an error, instead of a warning, if part of the scene cannot be traced as specified");
    add_word(app, "--filter", "FILTER", "filter in the sampling plane: bell (default) or none",
             [command](const std::string& word) {
                 if (word != "bell" && word != "none")
                     input_error({"--filter"}, "\"{}\" is not accepted; expected bell or none", word);
                 command->filter = word == "bell";
             });
    QuickLamp& quick = command->quick;
    add_quick_lamp(app, quick);
    add_planes(app, quick.views, quick.pixels, quick.distance);
    add_word(
        app, "--capture", "SHARE", "share of the light that the planes should capture (default 98%)",
        [command](const std::string& word) { command->quick.capture = parse_share({"--capture"}, word); });
    add_lamp_output(app, command->lamp);
    app.callback([command, &context, &app] {
        check_options(app, *command);
        act_acquire(*command, context);
    });
}

}  // namespace lucerna
