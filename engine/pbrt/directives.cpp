#include "engine/pbrt/directives.h"

#include <algorithm>

#include "engine/base/files.h"
#include "engine/base/names.h"

namespace lucerna {
namespace {

constexpr std::size_t kDeepestInclude = 64;

// Known to some version of pbrt, not to this reader.
constexpr std::string_view kKnownElsewhere[] = {"VolumeRegion"};

}  // namespace

const std::vector<DirectiveReader::Entry>& DirectiveReader::table() {
    using R = DirectiveReader;
    using enum Where;
    static const std::vector<Entry> entries = {
        {"Accelerator", options_only, &R::accelerator},
        {"ActiveTransform", anywhere, &R::active_transform},
        {"AreaLightSource", world_only, &R::area_light_source},
        {"Attribute", anywhere, &R::attribute},
        {"AttributeBegin", world_only, &R::attribute_begin},
        {"AttributeEnd", world_only, &R::attribute_end},
        {"Camera", options_only, &R::camera},
        {"ColorSpace", anywhere, &R::color_space},
        {"ConcatTransform", anywhere, &R::concat_transform},
        {"CoordSysTransform", anywhere, &R::coord_sys_transform},
        {"CoordinateSystem", anywhere, &R::coordinate_system},
        {"Film", options_only, &R::film},
        {"Identity", anywhere, &R::identity},
        {"Import", anywhere, &R::import},
        {"Include", anywhere, &R::include},
        {"Integrator", options_only, &R::integrator},
        {"LightSource", world_only, &R::light_source},
        {"LookAt", anywhere, &R::look_at_directive},
        {"MakeNamedMaterial", world_only, &R::make_named_material},
        {"MakeNamedMedium", anywhere, &R::make_named_medium},
        {"Material", world_only, &R::material},
        {"MediumInterface", anywhere, &R::medium_interface},
        {"NamedMaterial", world_only, &R::named_material},
        {"ObjectBegin", world_only, &R::object_begin},
        {"ObjectEnd", world_only, &R::object_end},
        {"ObjectInstance", world_only, &R::object_instance},
        {"Option", options_only, &R::option},
        {"PixelFilter", options_only, &R::pixel_filter},
        {"Renderer", options_only, &R::renderer},
        {"ReverseOrientation", world_only, &R::reverse_orientation},
        {"Rotate", anywhere, &R::rotate},
        {"Sampler", options_only, &R::sampler},
        {"Scale", anywhere, &R::scale},
        {"SearchPath", anywhere, &R::search_path},
        {"Shape", world_only, &R::shape},
        {"SurfaceIntegrator", options_only, &R::integrator},  // version 2's name
        {"Texture", world_only, &R::texture},
        {"Transform", anywhere, &R::transform},
        {"TransformBegin", anywhere, &R::transform_begin},
        {"TransformEnd", anywhere, &R::transform_end},
        {"TransformTimes", anywhere, &R::transform_times},
        {"Translate", anywhere, &R::translate},
        {"Volume", world_only, &R::volume},
        {"VolumeIntegrator", options_only, &R::volume_integrator},
        {"WorldBegin", options_only, &R::world_begin},
        {"WorldEnd", world_only, &R::world_end},
    };
    return entries;
}

DirectiveReader::DirectiveReader(Draft& draft, const std::filesystem::path& file,
                                 const SceneOverrides& overrides, Monitor& monitor)
    : reading_{.draft = draft,
               .monitor = monitor,
               .folder = file.parent_path(),
               .skip_missing = overrides.skip_missing},
      overrides_(overrides) {
    auto matte = std::make_shared<MaterialEntry>();  // pbrt's default: diffuse, reflectance 0.5
    matte->material = {"default", DiffuseMaterial{}};
    reading_.state.material = std::move(matte);
    coordinate_systems_["world"] = M44d();
}

void DirectiveReader::read(const Source& main) {
    files_.push_back({&main, Tokens(main)});
    Phase phase(reading_.monitor, "read scene", main.text().size());
    std::size_t reported = 0;
    for (;;) {
        if (tokens().peek().kind != Token::Kind::end) {
            directive();
        } else if (files_.size() > 1) {
            close_file();
        } else {
            break;
        }
        const std::size_t done = files_.front().tokens.peek().offset;
        phase.advance(done - reported);
        reported = done;
    }
    place_ = tokens().place();
    finish();
}

void DirectiveReader::directive() {
    place_ = tokens().place();
    const Token token = tokens().next();
    if (token.kind != Token::Kind::word) {
        const std::string_view hint =
            token.kind == Token::Kind::number ? "; several values of a parameter stand in [ ]" : "";
        fail(place_, "a directive is expected here, not \"{}\"{}", shown(token.text), hint);
    }
    const auto& entries = table();
    const auto entry =
        std::find_if(entries.begin(), entries.end(), [&](const Entry& e) { return e.name == token.text; });
    if (entry == entries.end()) {
        if (std::ranges::find(kKnownElsewhere, token.text) != std::ranges::end(kKnownElsewhere)) {
            fail(place_, "{} is not supported yet", token.text);
        }
        std::vector<std::string_view> names;
        for (const Entry& known : entries) names.push_back(known.name);
        fail(place_, "unknown directive \"{}\"; {}pbrt's directives are accepted", shown(token.text),
             did_you_mean(token.text, names));
    }
    if (stage_ == Stage::ended)
        fail(place_, "{} stands after WorldEnd; one scene per file is accepted", entry->name);
    if (entry->where == Where::world_only && stage_ == Stage::options) {
        fail(place_, "{} stands before WorldBegin; it is accepted after it", entry->name);
    }
    if (entry->where == Where::options_only && stage_ == Stage::world) {
        fail(place_, "{} stands after WorldBegin; it is accepted before it", entry->name);
    }
    name_ = entry->name;
    (this->*entry->action)();
}

void DirectiveReader::finish() {
    if (stage_ == Stage::options) fail(place_, "the file ends without WorldBegin");
    if (!saved_.empty()) fail(saved_.back().place, "this {} is never ended", saved_.back().directive);
    const auto seen = [&](std::string_view what) {
        return std::ranges::find(seen_once_, what) != seen_once_.end();
    };
    Draft& draft = reading_.draft;
    if (!seen("Camera")) {
        reading_.warn(place_,
                      "no Camera: a perspective one at the origin is taken, fov 90, looking along +z");
    }
    if (!seen("Film")) {
        reading_.warn(place_,
                      fmt::format("no Film: {} x {} pixels are taken", draft.film.width, draft.film.height));
    }
    if (!seen("Integrator")) {
        const std::string& name = overrides_.integrator;
        draft.integrator = make_settings(name.empty() ? "path" : name, {"--integrator"});
    }
    if (draft.occlusion) draft.lights.push_back({place_, InfiniteSpec{Rgb(1)}});
    apply_settings(draft.integrator, overrides_);
    integrate_media();
    if (const auto* progressive = std::get_if<ProgressiveSettings>(&draft.integrator)) {
        const std::int64_t spp = std::int64_t{draft.passes} * progressive->samples;
        if (spp > 0) draft.spp = static_cast<int>(std::min<std::int64_t>(spp, 1 << 24));
    }
    if (overrides_.spp > 0) draft.spp = overrides_.spp;
    if (!overrides_.output.empty()) draft.film.filename = overrides_.output;
    if (overrides_.resolution.x > 0) override_resolution();
}

// The same part of a picture of another size.
void DirectiveReader::override_resolution() {
    FilmSettings& film = reading_.draft.film;
    const V2i& size = overrides_.resolution;
    const auto scaled = [&](const V2i& at) {
        return V2i(static_cast<int>(std::int64_t{at.x} * size.x / film.width),
                   static_cast<int>(std::int64_t{at.y} * size.y / film.height));
    };
    if (film.crop_end != V2i(0, 0)) {
        film.crop_begin = scaled(film.crop_begin);
        film.crop_end = scaled(film.crop_end);
        film.crop_end.x = std::max(film.crop_end.x, film.crop_begin.x + 1);
        film.crop_end.y = std::max(film.crop_end.y, film.crop_begin.y + 1);
    }
    film.width = size.x;
    film.height = size.y;
}

void DirectiveReader::open_file(const std::string& name, bool import) {
    const std::filesystem::path file = reading_.resolve(name);
    for (const Open& open : files_) {
        if (open.source->name() == file.string()) {
            fail(place_, "{} \"{}\": this file is being read already; it includes itself", name_,
                 shown(name));
        }
    }
    if (files_.size() > kDeepestInclude) {
        fail(place_, "{} \"{}\": included files are nested more than {} deep", name_, shown(name),
             kDeepestInclude);
    }
    std::string text;
    try {
        std::error_code status;  // a pipe or device would block, or never end
        if (std::filesystem::exists(file, status) && std::filesystem::is_other(file, status)) {
            throw InputError({file.string()}, "is no regular file");
        }
        text = read_text(file);
    } catch (const InputError& error) {
        fail(place_, "{} \"{}\": {}", name_, shown(name), printable(error.what()));
    }
    reading_.draft.sources.push_back(std::make_unique<Source>(file.string(), std::move(text)));
    if (import) begin_block();
    files_.push_back({reading_.draft.sources.back().get(), Tokens(*reading_.draft.sources.back()), import});
}

void DirectiveReader::close_file() {
    const bool closes_block = files_.back().closes_block;
    files_.pop_back();
    if (closes_block) {
        name_ = "Import";
        end_block("Import");
    }
}

// ---- arguments

std::string DirectiveReader::quoted(std::string_view what) {
    const Place at = tokens().place();
    const Token token = tokens().next();
    if (token.kind != Token::Kind::string) {
        fail(at, "{} wants {} in quotes here, not \"{}\"", name_, what,
             token.kind == Token::Kind::end ? "the end of the file" : shown(token.text));
    }
    return string_value(token, at);
}

std::vector<double> DirectiveReader::numbers(std::size_t count, std::string_view what) {
    const bool bracket = tokens().peek().kind == Token::Kind::open;
    if (bracket) tokens().next();
    std::vector<double> values;
    while (values.size() < count && tokens().peek().kind == Token::Kind::number) {
        const Token token = tokens().next();
        values.push_back(number_value(token.text, tokens().place(token)));
    }
    const Token& rest = tokens().peek();
    if (values.size() != count || (bracket && rest.kind != Token::Kind::close)) {
        fail(tokens().place(), "{} wants {} numbers, {}; \"{}\" stands after {}", name_, count, what,
             rest.kind == Token::Kind::end ? "the end of the file" : shown(rest.text), values.size());
    }
    if (bracket) tokens().next();
    return values;
}

Params DirectiveReader::parameters(std::string_view kind, std::string_view target) {
    Params params = Params::read(tokens(), fmt::format("{} \"{}\"", name_, shown(kind)), place_);
    const auto& attributes = reading_.state.attributes;
    const auto defaults = attributes.find(target);
    if (defaults != attributes.end()) params.add_defaults(defaults->second);
    return params;
}

// ---- blocks

void DirectiveReader::begin_block() {
    saved_.push_back({name_, place_, reading_.state});
}

void DirectiveReader::end_block(std::string_view opening) {
    if (saved_.empty()) fail(place_, "{} without {}", name_, opening);
    Saved& last = saved_.back();
    if (last.directive != opening) {
        fail(place_, "{} meets the {} of {}; blocks must nest", name_, last.directive,
             to_string(last.place.location()));
    }
    if (opening == "TransformBegin") {
        reading_.state.ctm = last.state.ctm;
    } else {
        reading_.state = std::move(last.state);
    }
    saved_.pop_back();
}

void DirectiveReader::concatenate(const std::optional<M44d>& m, std::string_view what) {
    const std::optional<M44d> product =
        m ? std::optional(then(*m, reading_.state.ctm)) : std::optional<M44d>();
    if (!product || !inverse(*product)) {
        fail(place_, "{} {}: this cannot be undone; an invertible, affine, finite transformation is accepted",
             name_, what);
    }
    if (reading_.state.at_start) reading_.state.ctm = *product;
}

}  // namespace lucerna
