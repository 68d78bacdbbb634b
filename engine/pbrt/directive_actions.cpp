// Implements the action of each directive for DirectiveReader.
#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "engine/pbrt/directives.h"
#include "engine/text/spelling.h"

namespace lucerna {
namespace {

// Limits the defaults of one target, because each block that changes one has a list of its own.
constexpr std::size_t kMostDefaults = 64;
// Limits the depth of nested objects, because each is placed by way of all that contain it.
constexpr int kDeepestObject = 64;
constexpr std::uint64_t kMostInstances = 100'000'000;
// Limits the nodes that are evaluated for one value of a texture.
constexpr std::uint32_t kMostEvaluations = 512;

std::uint64_t saturated_sum(std::uint64_t a, std::uint64_t b) {
    return a > std::numeric_limits<std::uint64_t>::max() - b ? std::numeric_limits<std::uint64_t>::max()
                                                             : a + b;
}

std::string listed(const std::vector<double>& values) {
    return fmt::format("{:g}", fmt::join(values, " "));
}
V3d vector_at(const std::vector<double>& v, std::size_t first) {
    return {v[first], v[first + 1], v[first + 2]};
}

}  // namespace

template <typename Read>
bool DirectiveReader::leniently(const Params& params, std::string_view instead, const Read& read) {
    try {
        read();
        return true;
    } catch (const TextError& error) {
        if (params.ours() || reading_.leniency.strict()) throw;
        reading_.warn_or_refuse(error.place(), error.message(), instead);
        return false;
    }
}

// ---- transformations

void DirectiveReader::identity() {
    if (reading_.state.at_start) reading_.state.ctm = M44d();
}

void DirectiveReader::translate() {
    const auto v = numbers(3, "x y z");
    concatenate(translation(vector_at(v, 0)), listed(v));
}

void DirectiveReader::scale() {
    const auto v = numbers(3, "x y z");
    concatenate(scaling(vector_at(v, 0)), listed(v));
}

void DirectiveReader::rotate() {
    const auto v = numbers(4, "degrees and the axis x y z");
    const V3d axis = vector_at(v, 1);
    if (axis.length2() == 0) {
        return reading_.warn_or_refuse(place_, fmt::format("Rotate {}: the axis has no length", listed(v)),
                                       "the rotation is ignored");
    }
    concatenate(rotation(v[0], axis), listed(v));
}

void DirectiveReader::look_at_directive() {
    const auto v = numbers(9, "eye, target and up, x y z each");
    const std::optional<M44d> view = look_at(vector_at(v, 0), vector_at(v, 3), vector_at(v, 6));
    if (!view) {
        return reading_.warn_or_refuse(
            place_,
            fmt::format("LookAt {}: eye and target coincide, or up is parallel to the viewing direction",
                        listed(v)),
            "it is left out");
    }
    concatenate(*view, listed(v));
}

void DirectiveReader::active_transform() {
    const Place at = tokens().place();
    const Token token = tokens().next();
    const bool is_word = token.kind == Token::Kind::word || token.kind == Token::Kind::string;
    if (!is_word || (token.text != "StartTime" && token.text != "EndTime" && token.text != "All")) {
        fail(at, "ActiveTransform takes StartTime, EndTime or All, not \"{}\"", shown(token.text));
    }
    reading_.state.at_start = token.text != "EndTime";
    if (token.text != "All") {
        reading_.warn_or_refuse(place_, "motion is not supported", "the scene is rendered as at StartTime",
                                "motion blur");
    }
}

void DirectiveReader::transform_times() {
    numbers(2, "the start and the end of a movement");
}

void DirectiveReader::transform() {
    const auto v = numbers(16, "the columns of a matrix");
    if (v.empty()) return;
    if (reading_.state.at_start) reading_.state.ctm = M44d();
    concatenate(matrix_of(v), listed(v));
}

void DirectiveReader::concat_transform() {
    const auto v = numbers(16, "the columns of a matrix");
    if (v.empty()) return;
    concatenate(matrix_of(v), listed(v));
}

void DirectiveReader::coordinate_system() {
    coordinate_systems_[quoted("a name")] = reading_.state.ctm;
}

void DirectiveReader::coord_sys_transform() {
    const std::string name = quoted("a name");
    const auto found = coordinate_systems_.find(name);
    if (found == coordinate_systems_.end()) {
        std::vector<std::string_view> names;
        for (const auto& [known, ctm] : coordinate_systems_) names.push_back(known);
        return reading_.warn_or_refuse(place_,
                                       fmt::format("there is no coordinate system \"{}\"; {}{} are defined",
                                                   shown(name), did_you_mean(name, names), names.size()),
                                       "the transformation is not changed");
    }
    if (reading_.state.at_start) reading_.state.ctm = found->second;
}

void DirectiveReader::reverse_orientation() {
    reading_.state.reverse_orientation = !reading_.state.reverse_orientation;
}

// ---- blocks

void DirectiveReader::attribute_begin() {
    begin_block();
}
void DirectiveReader::attribute_end() {
    end_block("AttributeBegin");
}
void DirectiveReader::transform_begin() {
    begin_block();
}
void DirectiveReader::transform_end() {
    end_block("TransformBegin");
}

void DirectiveReader::attribute() {
    const std::string target = quoted("a target");
    constexpr std::string_view targets[] = {"shape", "light", "material", "medium", "texture"};
    if (std::ranges::find(targets, target) == std::ranges::end(targets)) {
        fail(place_, "Attribute \"{}\" is unknown; expected shape, light, material, medium or texture",
             shown(target));
    }
    Params params =
        Params::read(tokens(), fmt::format("Attribute \"{}\"", target), place_, reading_.leniency);
    params.add_to(reading_.part->directives);
    params.take_colours_in(reading_.state.colour_space);
    const auto& before = reading_.state.attributes;
    const auto changed =
        before ? std::make_shared<AttributeDefaults>(*before) : std::make_shared<AttributeDefaults>();
    ParamDefaults& known = (*changed)[target];
    for (const Param& param : params.all()) {
        std::erase_if(known, [&](const auto& p) { return p->name == param.name; });
        if (known.size() == kMostDefaults) {
            fail(param.place, "Attribute \"{}\" sets more than {} defaults, the limit", target,
                 kMostDefaults);
        }
        known.push_back(std::make_shared<const Param>(param));
    }
    reading_.state.attributes = changed;
}

void DirectiveReader::world_begin() {
    close_blocks("WorldBegin");
    stage_ = Stage::world;
    before_world_ = draft_.world;
    if (reading_.draft.occlusion) {
        reading_.state.material->material.model = DiffuseMaterial{RgbTexture::constant(Rgb(1))};
    }
    reading_.state.ctm = M44d();
    coordinate_systems_["world"] = M44d();
}

void DirectiveReader::world_end() {
    close_blocks("WorldEnd");
    stage_ = Stage::ended;
}

void DirectiveReader::include() {
    open_file(quoted("a file"), false);
}
void DirectiveReader::import() {
    open_file(quoted("a file"), true);
}

// ---- options

void DirectiveReader::once() {
    if (std::ranges::find(seen_in_frame_, name_) != seen_in_frame_.end()) {
        reading_.warn(place_, fmt::format("a second {}: it replaces the first", name_));
    }
    seen_.push_back(name_);
    seen_in_frame_.push_back(name_);
}

void DirectiveReader::camera() {
    once();
    const std::string kind = quoted("a kind of camera");
    Params params = parameters(kind, "");
    const std::optional<M44d> world_from_camera = inverse(reading_.state.ctm);
    if (!world_from_camera)
        fail(place_, "Camera: its transformation is not invertible");  // concatenate() only warns
    reading_.draft.camera = {};
    reading_.draft.lens.reset();
    reading_.draft.camera.world_from_camera = *world_from_camera;
    coordinate_systems_["camera"] = *world_from_camera;
    read_camera(reading_, kind, params);
    // The camera is in the outside medium of the medium interface that holds here.
    reading_.draft.camera_medium = reading_.state.media.outside;
    if (reading_.draft.camera_medium != kNoMedium) reading_.draft.uses_media = true;
    params.depart_unused();
}

void DirectiveReader::film() {
    option_of_kind("a kind of film", &read_film);
}
void DirectiveReader::sampler() {
    option_of_kind("a kind of sampler", &read_sampler);
}
void DirectiveReader::pixel_filter() {
    option_of_kind("a kind of filter", &read_filter);
}

void DirectiveReader::option_of_kind(std::string_view what, OptionReader reader) {
    once();
    const std::string kind = quoted(what);
    Params params = parameters(kind, "");
    reader(reading_, kind, params);
    params.depart_unused();
}

void DirectiveReader::integrator() {
    if (name_ == "SurfaceIntegrator") {  // name in versions 1 and 2
        reading_.old_dialect = true;
        name_ = "Integrator";
    }
    if (ignores_integrator_) {  // a Renderer of version 2 overrides it
        parameters(quoted("the name of an integrator"), "");
        return;
    }
    once();
    const std::string kind = quoted("the name of an integrator");
    Params params = parameters(kind, "");
    reading_.draft.integrator = read_integrator(reading_, kind, params, overrides_.integrator);
    params.depart_unused();
}

// Version 2's Renderer "metropolis" is an integrator; its other renderers are test tools around one.
void DirectiveReader::renderer() {
    reading_.old_dialect = true;
    const std::string kind = quoted("a kind of renderer");
    Params params = parameters(kind, "");
    if (kind == "metropolis") {
        if (params.has("samplesperpixel")) read_sampler(reading_, kind, params);
        reading_.draft.integrator = read_integrator(reading_, kind, params, overrides_.integrator);
        name_ = "Integrator";
        if (std::ranges::find(seen_in_frame_, name_) == seen_in_frame_.end()) once();
        ignores_integrator_ = true;
        params.accept({"bidirectional", "bootstrapsamples", "directsamples", "dodirectseparately",
                       "largestepprobability", "maxconsecutiverejects"});
    } else if (kind != "sampler") {
        if (kind != "aggregatetest" && kind != "createprobes" && kind != "surfacepoints") {
            reading_.warn_or_refuse(
                place_, fmt::format("unknown Renderer \"{}\"; known are sampler, metropolis", shown(kind)),
                "sampler is used");
        } else {
            reading_.warn_or_refuse(place_, fmt::format("Renderer \"{}\" does not render a picture", kind),
                                    "a picture is rendered");
        }
        for (const Param& param : params.all()) params.accept({param.name});
    }
    params.depart_unused();
}

// Skips version 1's list of plug-in folders.
void DirectiveReader::search_path() {
    reading_.old_dialect = true;
    quoted("a list of folders");
}

void DirectiveReader::accelerator() {
    // Only Embree is available, and the parameters of an accelerator change no image.
    parameters(quoted("a kind of accelerator"), "");
}

void DirectiveReader::color_space() {
    const std::string name = quoted("a colour space");
    const ColourSpace* space = find_colour_space(name);
    if (!space) {
        std::vector<std::string_view> names;
        for (const ColourSpace& known : colour_spaces()) names.push_back(known.name);
        reading_.warn_or_refuse(
            place_,
            fmt::format("ColorSpace \"{}\" is unknown; expected {}", shown(name), fmt::join(names, ", ")),
            "colours are read as sRGB", "saturation");
    }
    reading_.state.colour_space = name == "srgb" ? nullptr : space;
    const bool of_film = stage_ == Stage::options && std::ranges::count(seen_in_frame_, "Film") == 0;
    if (of_film) choose_working_space(name);
}

// Before Film, the colour space becomes the film's, and hence the working space if rendering supports it.
void DirectiveReader::choose_working_space(std::string_view name) {
    const std::optional<WorkingSpace> asked = WorkingSpace::named(name);
    if (overrides_.colours || !asked || *asked == draft_.film.colours) return;
    if (!draft_.media.empty()) {
        fail(place_,
             "ColorSpace \"{}\" sets the colours of the render, but comes after a medium; put it before "
             "MakeNamedMedium",
             shown(std::string(name)));
    }
    draft_.film.colours = *asked;
}

void DirectiveReader::option() {
    const Place at = tokens().place();
    Params params = Params::read(tokens(), "Option", place_, reading_.leniency);
    if (params.has("unit")) choose_unit(params);
    constexpr std::string_view known[] = {"disablepixeljitter",
                                          "disabletexturefiltering",
                                          "disablewavelengthjitter",
                                          "displacementedgescale",
                                          "forcediffuse",
                                          "msereferenceimage",
                                          "msereferenceout",
                                          "pixelstats",
                                          "rendercoordsys",
                                          "seed",
                                          "unit",
                                          "wavefront"};
    for (const Param& param : params.all()) {
        if (param.name == "unit") continue;
        const bool is_known = std::ranges::find(known, param.name) != std::ranges::end(known);
        if (is_known) {
            reading_.warn(at, fmt::format("Option \"{}\" has no effect", param.name));
        } else {
            reading_.warn_or_refuse(at,
                                    fmt::format("unknown Option \"{}\"; {}known are {}", shown(param.name),
                                                did_you_mean(param.name, known), fmt::join(known, ", ")),
                                    "it is left out");
        }
    }
}

// Reads the photometric unit, an option of Lucerna. It decides the meaning of all numbers of light, so errors
// are not tolerated.
void DirectiveReader::choose_unit(Params& params) {
    const Param* param = params.find_any("unit");
    const bool is_word = param->type == Param::Type::string && param->strings.size() == 1;
    const std::string word = is_word ? param->strings.front() : std::string();
    const std::optional<FluxUnit> unit = unit_named(word);
    if (!unit) {
        constexpr std::string_view known[] = {"photometric", "radiometric"};
        fail(param->place, "Option \"string unit\" is \"{}\"; {}expected photometric or radiometric",
             shown(word), did_you_mean(word, known));
    }
    if (overrides_.unit || draft_.unit == unit) return;
    if (!draft_.media.empty()) {
        fail(param->place,
             "Option \"string unit\" \"{}\" sets the unit of all light, but comes after a medium; put it "
             "before MakeNamedMedium",
             word);
    }
    draft_.unit = unit;
}

void DirectiveReader::medium_interface() {
    const std::string inside = quoted("a medium");
    const std::string outside = tokens().peek().kind == Token::Kind::string ? quoted("a medium") : inside;
    reading_.state.media = read_medium_interface(reading_, place_, inside, outside);
}

void DirectiveReader::make_named_medium() {
    const std::string name = quoted("a name");
    Params params = parameters(name, "medium");
    const bool whole = leniently(params, "the medium is left out, and vacuum is used instead",
                                 [&] { read_named_medium(reading_, name, params); });
    if (whole) params.depart_unused();
}

// Reads the orders of scattering to render, which the surface integrator decides here.
void DirectiveReader::volume_integrator() {
    reading_.old_dialect = true;
    once();
    const std::string kind = quoted("a kind of volume integrator");
    Params params = parameters(kind, "");
    if (kind != "single" && kind != "emission") {
        reading_.warn_or_refuse(
            place_, fmt::format("unknown VolumeIntegrator \"{}\"; known are single, emission", shown(kind)),
            "media are rendered by the integrator");
    }
    params.accept({"stepsize"});
    params.depart_unused();
    reading_.monitor.info(
        fmt::format("{}: VolumeIntegrator \"{}\": media are rendered without ray marching, and with all "
                    "orders of scattering unless the integrator is \"direct\"",
                    to_string(place_.location()), kind));
}

void DirectiveReader::integrate_media() {
    settle_media(reading_);
    Draft& draft = reading_.draft;
    if (draft.occlusion) draft.uses_media = false;
    if (!draft.uses_media || std::holds_alternative<PathSettings>(draft.integrator)) return;
    for (const DraftMedium& made : draft.media) {
        if (!made.medium || !made.medium->emits()) continue;
        reading_.warn_or_refuse(
            made.place,
            fmt::format("medium \"{}\" emits light, which \"{}\" does not transport to surfaces",
                        shown(made.name), integrator_name(draft.integrator)),
            "the scene is rendered by \"path\"");
        draft.integrator = PathSettings{};
        return;
    }
}

// ---- the world

Material DirectiveReader::read_made_of(const std::string& kind, Params& params) {
    Material material{kind, DiffuseMaterial{}};
    const bool whole = leniently(params, "matte of reflectance 0.5 is used",
                                 [&] { material = read_material(reading_, kind, params); });
    if (whole) params.depart_unused();
    const bool white = reading_.draft.occlusion && !is_interface(material);
    return white ? Material{kind, DiffuseMaterial{RgbTexture::constant(Rgb(1))}} : material;
}

void DirectiveReader::material() {
    const std::string kind = quoted("a kind of material");
    Params params = parameters(kind, "material");
    auto entry = std::make_shared<MaterialEntry>();
    entry->material = read_made_of(kind, params);
    reading_.state.material = std::move(entry);
}

void DirectiveReader::make_named_material() {
    const std::string name = quoted("a name");
    Params params = parameters(name, "material");
    std::string kind = params.string("type", "");
    if (!params.has("type")) {
        reading_.warn_or_refuse(
            place_,
            fmt::format("MakeNamedMaterial \"{}\" lacks \"string type\", the kind of material", shown(name)),
            "matte is used");
        kind = "matte";
    }
    auto entry = std::make_shared<MaterialEntry>();
    entry->material = read_made_of(kind, params);
    entry->material.name = name;
    if (reading_.materials.contains(name)) {
        reading_.warn(place_,
                      fmt::format("material \"{}\" is defined again; the new definition applies from here on",
                                  shown(name)));
    }
    reading_.materials[name] = std::move(entry);
}

template <typename Made>
const std::string& DirectiveReader::never_made(std::string_view kind, const std::string& name,
                                               const Made& made) {
    std::string& message = never_made_[fmt::format("{} {}", kind, name)];
    if (!message.empty()) return message;
    std::vector<std::string_view> names;
    for (const auto& [known, entry] : made) names.push_back(known);
    message = fmt::format("there is no {} \"{}\"; {}{} are defined", kind, shown(name),
                          did_you_mean(name, names), names.size());
    return message;
}

void DirectiveReader::named_material() {
    const std::string name = quoted("a name");
    const auto found = reading_.materials.find(name);
    if (found == reading_.materials.end()) {
        return reading_.warn_or_refuse(place_, never_made("material", name, reading_.materials),
                                       fmt::format("the current material is kept (\"{}\")",
                                                   shown(reading_.state.material->material.name)));
    }
    reading_.state.material = found->second;
}

void DirectiveReader::texture() {
    const std::string name = quoted("a name");
    const std::string type = quoted("a type");
    const std::string kind = quoted("a kind of texture");
    const bool of_floats = type == "float";
    Params params = parameters(kind, "texture");
    if (!of_floats && type != "spectrum" && type != "color") {
        return reading_.warn_or_refuse(
            place_,
            fmt::format("Texture \"{}\": unknown type \"{}\"; expected spectrum or float", shown(name),
                        shown(type)),
            "it is left out");
    }
    // Textures of colours and of floats have separate names.
    if (of_floats ? reading_.float_textures.contains(name) : reading_.textures.contains(name)) {
        reading_.warn(place_,
                      fmt::format("texture \"{}\" is defined again; the new definition applies from here on",
                                  shown(name)));
    }
    std::uint32_t evaluations = 0;
    const bool whole = leniently(params, "it is left out", [&] {
        if (of_floats) {
            FloatTexture& made = reading_.float_textures[name] = read_float_texture(reading_, kind, params);
            evaluations = made.evaluations();
        } else {
            NamedTexture& made = reading_.textures[name] = read_texture(reading_, kind, params);
            evaluations = made.texture.evaluations();
        }
    });
    if (evaluations > kMostEvaluations) {
        fail(place_, "Texture \"{}\" evaluates {} textures for one value; the limit is {}", shown(name),
             evaluations, kMostEvaluations);
    }
    if (whole) params.depart_unused();
}

void DirectiveReader::object_begin() {
    if (reading_.object) {
        reading_.warn_or_refuse(
            place_,
            fmt::format(
                "ObjectBegin within the ObjectBegin of \"{}\"; objects may contain shapes and instances only",
                shown(object_name_)),
            "the outer object ends here");
        complete_object();
    }
    object_name_ = quoted("a name");
    begin_block();
    reading_.draft.objects.push_back(std::make_unique<DraftObject>());
    reading_.object = reading_.draft.objects.back().get();
}

void DirectiveReader::object_end() {
    if (end_block("ObjectBegin") && reading_.object) complete_object();
}

void DirectiveReader::complete_object() {
    DraftObject& object = *reading_.object;
    if (!object.shapes.empty()) object.shown = saturated_sum(object.shown, 1);
    reading_.object = nullptr;
    if (objects_.contains(object_name_)) {
        reading_.warn(place_,
                      fmt::format("object \"{}\" is defined again; the new definition applies from here on",
                                  shown(object_name_)));
    }
    objects_[object_name_] = reading_.draft.objects.size() - 1;
}

void DirectiveReader::object_instance() {
    const std::string name = quoted("the name of an object");
    const auto found = objects_.find(name);
    if (found == objects_.end()) {
        return reading_.warn_or_refuse(place_, never_made("object", name, objects_), "it is left out");
    }
    if (!inverse(reading_.state.ctm)) {
        return reading_.warn_or_refuse(
            place_, fmt::format("ObjectInstance \"{}\": its transformation is not invertible", shown(name)),
            "it is left out");
    }
    const DraftInstance instance{found->second, reading_.state.ctm};
    const DraftObject& shown_object = *reading_.draft.objects[found->second];
    if (reading_.object) {
        DraftObject& outer = *reading_.object;
        outer.instances.push_back(instance);
        outer.shown = saturated_sum(outer.shown, shown_object.shown);
        outer.depth = std::max(outer.depth, shown_object.depth + 1);
        if (outer.depth > kDeepestObject) {
            fail(place_, "ObjectInstance \"{}\": objects are nested more than {} deep, the limit",
                 shown(name), kDeepestObject);
        }
        return;
    }
    reading_.draft.instances.push_back(instance);
    shown_ = saturated_sum(shown_, shown_object.shown);
    if (shown_ > kMostInstances) {
        fail(place_, "ObjectInstance \"{}\": {} instances, counting nested ones; the limit is {}",
             shown(name), shown_, kMostInstances);
    }
}

void DirectiveReader::shape() {
    const std::string kind = quoted("a kind of shape");
    Params params = parameters(kind, "shape");
    if (leniently(params, "the shape is left out", [&] { read_shape(reading_, kind, params); }))
        params.depart_unused();
}

void DirectiveReader::calculation_surface() {
    const std::string name = quoted("the name of the surface");
    Params params = parameters(name, "surface");
    read_calculation_surface(reading_, name, params);
    params.depart_unused();
}

void DirectiveReader::volume() {
    reading_.old_dialect = true;
    const std::string kind = quoted("a kind of volume");
    Params params = parameters(kind, "medium");
    if (leniently(params, "it is left out", [&] { read_volume(reading_, kind, params); }))
        params.depart_unused();
}

void DirectiveReader::light_source() {
    const std::string kind = quoted("a kind of light");
    Params params = parameters(kind, "light");
    const std::size_t before = reading_.draft.lights.size();
    const bool whole =
        leniently(params, "the light is left out", [&] { read_light(reading_, kind, params); });
    if (reading_.draft.occlusion) reading_.draft.lights.resize(before, DraftLight{place_, PointSpec{}});
    if (whole) params.depart_unused();
}

void DirectiveReader::area_light_source() {
    const std::string kind = quoted("a kind of light");
    Params params = parameters(kind, "light");
    reading_.state.area_light = nullptr;
    const bool whole = leniently(params, "the shapes emit nothing", [&] {
        reading_.state.area_light = read_area_light(reading_, kind, params);
    });
    if (reading_.draft.occlusion) reading_.state.area_light = nullptr;
    if (whole) params.depart_unused();
}

}  // namespace lucerna
