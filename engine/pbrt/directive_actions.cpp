// What each directive does: the other half of DirectiveReader.
#include <fmt/format.h>

#include <algorithm>

#include "engine/base/names.h"
#include "engine/pbrt/directives.h"

namespace lucerna {
namespace {

std::string listed(const std::vector<double>& values) {
    return fmt::format("{:g}", fmt::join(values, " "));
}
V3d vector_at(const std::vector<double>& v, std::size_t first) {
    return {v[first], v[first + 1], v[first + 2]};
}

}  // namespace

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
    if (axis.length2() == 0) fail(place_, "Rotate {}: the axis has no length", listed(v));
    concatenate(rotation(v[0], axis), listed(v));
}

void DirectiveReader::look_at_directive() {
    const auto v = numbers(9, "eye, target and up, x y z each");
    const std::optional<M44d> view = look_at(vector_at(v, 0), vector_at(v, 3), vector_at(v, 6));
    if (!view) fail(place_, "LookAt {}: eye and target coincide, or up points along the view", listed(v));
    concatenate(view, listed(v));
}

void DirectiveReader::active_transform() {
    const Place at = tokens().place();
    const Token token = tokens().next();
    const bool is_word = token.kind == Token::Kind::word || token.kind == Token::Kind::string;
    if (!is_word || (token.text != "StartTime" && token.text != "EndTime" && token.text != "All")) {
        fail(at, "ActiveTransform wants StartTime, EndTime or All, not \"{}\"", shown(token.text));
    }
    reading_.state.at_start = token.text != "EndTime";
    if (token.text != "All") {
        reading_.warn(place_, "nothing moves here: the scene is shown as it stands at StartTime");
    }
}

void DirectiveReader::transform_times() {
    numbers(2, "the start and the end of a movement");
}

void DirectiveReader::transform() {
    const auto v = numbers(16, "the columns of a matrix");
    if (reading_.state.at_start) reading_.state.ctm = M44d();
    concatenate(matrix_of(v), listed(v));
}

void DirectiveReader::concat_transform() {
    const auto v = numbers(16, "the columns of a matrix");
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
        fail(place_, "no coordinate system \"{}\" was named; there are {}", shown(name),
             fmt::join(names, ", "));
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
        fail(place_, "Attribute \"{}\" is unknown; shape, light, material, medium and texture are accepted",
             shown(target));
    }
    const Params params = Params::read(tokens(), fmt::format("Attribute \"{}\"", target), place_);
    for (const Param& param : params.all()) {
        auto& known = reading_.state.attributes[target];
        std::erase_if(known, [&](const Param& p) { return p.name == param.name; });
        known.push_back(param);
    }
}

void DirectiveReader::world_begin() {
    if (!saved_.empty())
        fail(saved_.back().place, "this {} is not ended before WorldBegin", saved_.back().directive);
    stage_ = Stage::world;
    if (reading_.draft.occlusion) {
        reading_.state.material->material.model = DiffuseMaterial{RgbTexture::constant(Rgb(1))};
    }
    reading_.state.ctm = M44d();
    coordinate_systems_["world"] = M44d();
}

void DirectiveReader::world_end() {
    if (!saved_.empty())
        fail(saved_.back().place, "this {} is not ended before WorldEnd", saved_.back().directive);
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
    if (std::ranges::find(seen_once_, name_) != seen_once_.end()) {
        reading_.warn(place_, fmt::format("a second {}: it takes the place of the first", name_));
    }
    seen_once_.push_back(name_);
}

void DirectiveReader::camera() {
    once();
    const std::string kind = quoted("a kind of camera");
    Params params = parameters(kind, "");
    const std::optional<M44d> world_from_camera = inverse(reading_.state.ctm);
    if (!world_from_camera)
        fail(place_, "Camera: its transformation cannot be undone");  // concatenate() saw to it
    reading_.draft.camera = {};
    reading_.draft.camera.world_from_camera = *world_from_camera;
    coordinate_systems_["camera"] = *world_from_camera;
    read_camera(reading_, kind, params);
    // What lies outside of things is where the camera stands.
    reading_.draft.camera_medium = reading_.state.media.outside;
    if (reading_.draft.camera_medium != kNoMedium) reading_.draft.uses_media = true;
    params.warn_unused(reading_.monitor);
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
    params.warn_unused(reading_.monitor);
}

void DirectiveReader::integrator() {
    if (name_ == "SurfaceIntegrator") {  // version 1's and 2's name
        reading_.old_dialect = true;
        name_ = "Integrator";
    }
    if (ignores_integrator_) {  // version 2's Renderer stands above it
        parameters(quoted("the name of an integrator"), "");
        return;
    }
    once();
    const std::string kind = quoted("the name of an integrator");
    Params params = parameters(kind, "");
    reading_.draft.integrator = read_integrator(reading_, kind, params, overrides_.integrator);
    params.warn_unused(reading_.monitor);
}

// Version 2's Renderer "metropolis" is an integrator; its others are bench tools around one.
void DirectiveReader::renderer() {
    reading_.old_dialect = true;
    const std::string kind = quoted("a kind of renderer");
    Params params = parameters(kind, "");
    if (kind == "metropolis") {
        if (params.has("samplesperpixel")) read_sampler(reading_, kind, params);
        reading_.draft.integrator = read_integrator(reading_, kind, params, overrides_.integrator);
        name_ = "Integrator";
        if (std::ranges::find(seen_once_, name_) == seen_once_.end()) once();
        ignores_integrator_ = true;
        params.accept({"bidirectional", "bootstrapsamples", "directsamples", "dodirectseparately",
                       "largestepprobability", "maxconsecutiverejects"});
    } else if (kind != "sampler") {
        if (kind != "aggregatetest" && kind != "createprobes" && kind != "surfacepoints") {
            refuse_kind(place_, "Renderer", kind, {"sampler", "metropolis"}, {});
        }
        reading_.warn(place_, fmt::format("Renderer \"{}\" makes no picture; one is rendered instead", kind));
        for (const Param& param : params.all()) params.accept({param.name});
    }
    params.warn_unused(reading_.monitor);
}

// Version 1's; plug-ins are not a thing here.
void DirectiveReader::search_path() {
    reading_.old_dialect = true;
    quoted("a list of folders");
}

void DirectiveReader::accelerator() {
    // Embree is the only one here, and what it is told changes no image.
    parameters(quoted("a kind of accelerator"), "");
}

void DirectiveReader::color_space() {
    const std::string name = quoted("a colour space");
    if (name != "srgb")
        refuse_kind(place_, "ColorSpace", name, {"srgb"}, {"aces2065-1", "rec2020", "dci-p3"});
}

void DirectiveReader::option() {
    const Place at = tokens().place();
    const Params params = Params::read(tokens(), "Option", place_);
    if (params.all().size() != 1) fail(at, "Option wants one parameter, {} are given", params.all().size());
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
                                          "wavefront"};
    const std::string& name = params.all().front().name;
    if (std::ranges::find(known, name) == std::ranges::end(known)) {
        fail(at, "unknown Option \"{}\"; known are {}", shown(name), fmt::join(known, ", "));
    }
    reading_.warn(at, fmt::format("Option \"{}\" has no effect", name));
}

void DirectiveReader::medium_interface() {
    const std::string inside = quoted("a medium");
    const std::string outside = tokens().peek().kind == Token::Kind::string ? quoted("a medium") : inside;
    reading_.state.media = read_medium_interface(reading_, place_, inside, outside);
}

void DirectiveReader::make_named_medium() {
    const std::string name = quoted("a name");
    Params params = parameters(name, "medium");
    read_named_medium(reading_, name, params);
    params.warn_unused(reading_.monitor);
}

// Which orders of scattering are looked for; here the surface integrator decides that.
void DirectiveReader::volume_integrator() {
    reading_.old_dialect = true;
    once();
    const std::string kind = quoted("a kind of volume integrator");
    Params params = parameters(kind, "");
    if (kind != "single" && kind != "emission") {
        refuse_kind(place_, "VolumeIntegrator", kind, {"single", "emission"}, {});
    }
    params.accept({"stepsize"});
    params.warn_unused(reading_.monitor);
    reading_.monitor.info(
        fmt::format("{}: VolumeIntegrator \"{}\": media are rendered without steps, and with all orders of "
                    "scattering unless the integrator is \"direct\"",
                    to_string(place_.location()), kind));
}

void DirectiveReader::integrate_media() {
    require_media(reading_);
    Draft& draft = reading_.draft;
    if (draft.occlusion) draft.uses_media = false;
    if (!draft.uses_media || std::holds_alternative<PathSettings>(draft.integrator)) return;
    for (const DraftMedium& made : draft.media) {
        if (!made.medium || !made.medium->emits()) continue;
        reading_.warn(made.place,
                      fmt::format("medium \"{}\" emits light, which \"{}\" does not carry to surfaces; "
                                  "the scene is rendered by \"path\"",
                                  shown(made.name), integrator_name(draft.integrator)));
        draft.integrator = PathSettings{};
        return;
    }
}

// ---- the world

Material DirectiveReader::read_made_of(const std::string& kind, Params& params) {
    const Material material = read_material(reading_, kind, params);
    const bool white = reading_.draft.occlusion && !is_interface(material);
    return white ? Material{kind, DiffuseMaterial{RgbTexture::constant(Rgb(1))}} : material;
}

void DirectiveReader::material() {
    const std::string kind = quoted("a kind of material");
    Params params = parameters(kind, "material");
    auto entry = std::make_shared<MaterialEntry>();
    entry->material = read_made_of(kind, params);
    params.warn_unused(reading_.monitor);
    reading_.state.material = std::move(entry);
}

void DirectiveReader::make_named_material() {
    const std::string name = quoted("a name");
    Params params = parameters(name, "material");
    const std::string kind = params.string("type", "");
    if (!params.has("type")) {
        fail(place_, "MakeNamedMaterial \"{}\" lacks \"string type\", the kind of material", shown(name));
    }
    auto entry = std::make_shared<MaterialEntry>();
    entry->material = read_made_of(kind, params);
    entry->material.name = name;
    params.warn_unused(reading_.monitor);
    if (reading_.materials.contains(name)) {
        reading_.warn(
            place_, fmt::format("material \"{}\" was made before; the new one holds from here", shown(name)));
    }
    reading_.materials[name] = std::move(entry);
}

void DirectiveReader::named_material() {
    const std::string name = quoted("a name");
    const auto found = reading_.materials.find(name);
    if (found == reading_.materials.end()) {
        std::vector<std::string_view> names;
        for (const auto& [known, entry] : reading_.materials) names.push_back(known);
        fail(place_, "no material \"{}\" was made before; {}there are {}", shown(name),
             did_you_mean(name, names), names.size());
    }
    reading_.state.material = found->second;
}

void DirectiveReader::texture() {
    const std::string name = quoted("a name");
    const std::string type = quoted("a type");
    const std::string kind = quoted("a kind of texture");
    const bool of_floats = type == "float";
    if (!of_floats && type != "spectrum" && type != "color") {
        fail(place_, "Texture \"{}\": unknown type \"{}\"; spectrum and float are accepted", shown(name),
             shown(type));
    }
    Params params = parameters(kind, "texture");
    // Colours and floats have names of their own.
    if (of_floats ? reading_.float_textures.contains(name) : reading_.textures.contains(name)) {
        reading_.warn(
            place_, fmt::format("texture \"{}\" was made before; the new one holds from here", shown(name)));
    }
    if (of_floats) {
        reading_.float_textures[name] = read_float_texture(reading_, kind, params);
    } else {
        reading_.textures[name] = read_texture(reading_, kind, params);
    }
    params.warn_unused(reading_.monitor);
}

void DirectiveReader::object_begin() {
    if (reading_.object) {
        fail(place_, "ObjectBegin within the ObjectBegin of \"{}\"; objects hold shapes and instances",
             shown(object_name_));
    }
    object_name_ = quoted("a name");
    begin_block();
    reading_.draft.objects.push_back(std::make_unique<DraftObject>());
    reading_.object = reading_.draft.objects.back().get();
}

void DirectiveReader::object_end() {
    end_block("ObjectBegin");
    reading_.object = nullptr;
    if (objects_.contains(object_name_)) {
        reading_.warn(place_, fmt::format("object \"{}\" was made before; the new one holds from here",
                                          shown(object_name_)));
    }
    objects_[object_name_] = reading_.draft.objects.size() - 1;
}

void DirectiveReader::object_instance() {
    const std::string name = quoted("the name of an object");
    const auto found = objects_.find(name);
    if (found == objects_.end()) {
        std::vector<std::string_view> names;
        for (const auto& [known, index] : objects_) names.push_back(known);
        fail(place_, "no object \"{}\" was made before; {}there are {}", shown(name),
             did_you_mean(name, names), names.size());
    }
    const DraftInstance instance{found->second, reading_.state.ctm};
    (reading_.object ? reading_.object->instances : reading_.draft.instances).push_back(instance);
}

void DirectiveReader::shape() {
    const std::string kind = quoted("a kind of shape");
    Params params = parameters(kind, "shape");
    read_shape(reading_, kind, params);
    params.warn_unused(reading_.monitor);
}

void DirectiveReader::volume() {
    reading_.old_dialect = true;
    const std::string kind = quoted("a kind of volume");
    Params params = parameters(kind, "medium");
    read_volume(reading_, kind, params);
    params.warn_unused(reading_.monitor);
}

void DirectiveReader::light_source() {
    const std::string kind = quoted("a kind of light");
    Params params = parameters(kind, "light");
    const std::size_t before = reading_.draft.lights.size();
    read_light(reading_, kind, params);
    if (reading_.draft.occlusion) reading_.draft.lights.resize(before, DraftLight{place_, PointSpec{}});
    params.warn_unused(reading_.monitor);
}

void DirectiveReader::area_light_source() {
    const std::string kind = quoted("a kind of light");
    Params params = parameters(kind, "light");
    reading_.state.area_light = read_area_light(reading_, kind, params);
    if (reading_.draft.occlusion) reading_.state.area_light = nullptr;
    params.warn_unused(reading_.monitor);
}

}  // namespace lucerna
