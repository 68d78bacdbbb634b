#include "engine/pbrt/directives.h"

#include <algorithm>

#include "engine/system/files.h"
#include "engine/system/memory.h"
#include "engine/text/spelling.h"

namespace lucerna {
namespace {

// Limits inclusion. Files may be included repeatedly; reading one again costs no memory, but time.
constexpr std::size_t kDeepestInclude = 64, kMostIncludes = 65'536;
constexpr std::size_t kMostTextAgain = std::size_t{512} << 20;

// Tells whether a light is Lucerna's own, unknown to pbrt.
bool is_own_light(std::string_view kind) {
    constexpr std::string_view kOurs[] = {"photometric", "ies", "ldt", "lightfield", "rayfile", "sky"};
    return std::ranges::find(kOurs, kind) != std::ranges::end(kOurs);
}

bool is_own_shape(std::string_view kind) {
    return kind == "arraymesh";
}

}  // namespace

const std::vector<DirectiveReader::Entry>& DirectiveReader::table() {
    using R = DirectiveReader;
    using enum Where;
    using enum Part;
    static const std::vector<Entry> entries = {
        {"Accelerator", options_only, neither, &R::accelerator},
        {"ActiveTransform", anywhere, neither, &R::active_transform},
        {"AreaLightSource", world_only, world, &R::area_light_source},
        {"Attribute", anywhere, world, &R::attribute},
        {"AttributeBegin", world_only, neither, &R::attribute_begin},
        {"AttributeEnd", world_only, neither, &R::attribute_end},
        {"Camera", options_only, view, &R::camera},
        {"ColorSpace", anywhere, world, &R::color_space},
        {"ConcatTransform", anywhere, neither, &R::concat_transform},
        {"CoordSysTransform", anywhere, neither, &R::coord_sys_transform},
        {"CoordinateSystem", anywhere, neither, &R::coordinate_system},
        {"CalculationSurface", world_only, view, &R::calculation_surface},
        {"Film", options_only, view, &R::film},
        {"Identity", anywhere, neither, &R::identity},
        {"Import", anywhere, neither, &R::import},
        {"Include", anywhere, neither, &R::include},
        {"Integrator", options_only, neither, &R::integrator},
        {"LightSource", world_only, world, &R::light_source},
        {"LookAt", anywhere, neither, &R::look_at_directive},
        {"MakeNamedMaterial", world_only, world, &R::make_named_material},
        {"MakeNamedMedium", anywhere, world, &R::make_named_medium},
        {"Material", world_only, world, &R::material},
        {"MediumInterface", anywhere, world, &R::medium_interface},
        {"NamedMaterial", world_only, world, &R::named_material},
        {"ObjectBegin", world_only, world, &R::object_begin},
        {"ObjectEnd", world_only, world, &R::object_end},
        {"ObjectInstance", world_only, world, &R::object_instance},
        {"Option", options_only, neither, &R::option},
        {"PixelFilter", options_only, view, &R::pixel_filter},
        {"Renderer", options_only, neither, &R::renderer},
        {"ReverseOrientation", world_only, world, &R::reverse_orientation},
        {"Rotate", anywhere, neither, &R::rotate},
        {"Sampler", options_only, neither, &R::sampler},
        {"Scale", anywhere, neither, &R::scale},
        {"SearchPath", anywhere, neither, &R::search_path},
        {"Shape", world_only, world, &R::shape},
        {"SurfaceIntegrator", options_only, neither, &R::integrator},  // name in version 2
        {"Texture", world_only, world, &R::texture},
        {"Transform", anywhere, neither, &R::transform},
        {"TransformBegin", anywhere, neither, &R::transform_begin},
        {"TransformEnd", anywhere, neither, &R::transform_end},
        {"TransformTimes", anywhere, neither, &R::transform_times},
        {"Translate", anywhere, neither, &R::translate},
        {"Volume", world_only, world, &R::volume},
        {"VolumeIntegrator", options_only, neither, &R::volume_integrator},
        {"WorldBegin", options_only, neither, &R::world_begin},
        {"WorldEnd", world_only, neither, &R::world_end},
    };
    return entries;
}

DirectiveReader::DirectiveReader(std::string text, const std::filesystem::path& file,
                                 const SceneOverrides& overrides, Monitor& monitor)
    : reading_{.draft = draft_,
               .monitor = monitor,
               .leniency = Leniency(monitor, overrides.strict),
               .folder = file.parent_path(),
               .meshes = &overrides.meshes,
               .skip_missing = overrides.skip_missing},
      overrides_(overrides) {
    draft_.film.colours = overrides.colours.value_or(WorkingSpace());
    draft_.unit = overrides.unit;
    draft_.far_field = overrides.far_field;
    draft_.lamp_file = overrides.lamp_file;
    draft_.without_sun = overrides.without_sun;
    draft_.sources.push_back(std::make_shared<const Source>(file.string(), std::move(text)));
    files_.push_back({draft_.sources.front().get(), Tokens(*draft_.sources.front())});
    begin_frame();
}

// Starts a frame with the options of the previous one, an empty world and no names.
void DirectiveReader::begin_frame() {
    reading_.state = {};
    auto matte = std::make_shared<MaterialEntry>();  // pbrt's default: diffuse with reflectance 0.5
    matte->material = {"default", DiffuseMaterial{}};
    reading_.state.material = std::move(matte);
    reading_.textures.clear();
    reading_.float_textures.clear();
    reading_.materials.clear();
    reading_.object = nullptr;
    objects_.clear();
    shown_ = 0;
    never_made_.clear();
    coordinate_systems_.clear();
    coordinate_systems_["world"] = M44d();
    saved_.clear();
    seen_in_frame_.clear();
    stage_ = Stage::options;
}

bool DirectiveReader::more() {
    while (tokens().peek().kind == Token::Kind::end && files_.size() > 1) close_file();
    return tokens().peek().kind != Token::Kind::end;
}

void DirectiveReader::leave_rest() {
    if (!more()) return;
    reading_.warn_or_refuse(tokens().place(), "the text after WorldEnd is another frame",
                            "only the first one is used");
    reading_.leniency.sum_up();
}

std::optional<Draft> DirectiveReader::next() {
    if (frames_ > 0) {
        if (!more()) return std::nullopt;
        draft_ = std::move(options_);
        begin_frame();
    }
    const Source& main = *draft_.sources.front();
    std::size_t reported = files_.front().tokens.peek().offset;
    Phase phase(reading_.monitor, "read scene", main.text().size() - reported);
    while (stage_ != Stage::ended && more()) {
        directive();
        const std::size_t done = files_.front().tokens.peek().offset;
        phase.advance(done - reported);
        reported = done;
    }
    phase.advance(main.text().size() - reported);  // the rest belongs to other frames
    if (stage_ != Stage::ended) place_ = tokens().place();
    if (frames_ > 0 && stage_ == Stage::options) {
        reading_.warn(place_, "the text after the last WorldEnd has no WorldBegin and is ignored");
        reading_.leniency.sum_up();
        return std::nullopt;
    }
    finish();
    ++frames_;
    reading_.leniency.sum_up();
    return std::move(draft_);
}

// Checks memory now and then, as small pieces such as shapes, lights and names do not check it themselves.
void DirectiveReader::require_room() {
    constexpr std::uint64_t kEvery = 256, kRoom = std::uint64_t{64} << 20;
    if (++directives_ % kEvery != 0) return;
    require_memory(kRoom,
                   to_string(place_.location()) + ": the scene so far fills the memory, and its next part",
                   "use a smaller scene");
}

void DirectiveReader::directive() {
    place_ = tokens().place();
    require_room();
    const Token token = tokens().next();
    if (token.kind != Token::Kind::word) {
        const std::string_view hint =
            token.kind == Token::Kind::number ? "; put several values of a parameter in [ ]" : "";
        fail(place_, "a directive is expected here, not \"{}\"{}", shown(token.text), hint);
    }
    const auto& entries = table();
    const auto entry =
        std::find_if(entries.begin(), entries.end(), [&](const Entry& e) { return e.name == token.text; });
    if (entry == entries.end()) {
        std::vector<std::string_view> names;
        for (const Entry& known : entries) names.push_back(known.name);
        fail(place_, "unknown directive \"{}\"; {}expected a directive of pbrt", shown(token.text),
             did_you_mean(token.text, names));
    }
    name_ = entry->name;
    reading_.place = place_;
    reading_.part = part_of(*entry);
    if (stands_here(*entry)) {
        note_directive(*entry);
        (this->*entry->action)();
    }
    for (const Open& open : files_) depart_oddities(*open.source);
}

// Integrator and samples are recorded separately; transformations count where they place something.
SceneText* DirectiveReader::part_of(const Entry& entry) {
    if (entry.part == Part::neither) return nullptr;
    return entry.part == Part::view ? &draft_.view : &draft_.world;
}

// Records a directive and, unless it may stand anywhere, the transformation. Before WorldBegin the
// transformation is the camera's, so directives that may stand on both sides and depend on it record it
// themselves (read_named_medium).
void DirectiveReader::note_directive(const Entry& entry) {
    if (!reading_.part) return;
    reading_.part->directives.add(entry.name);
    if (entry.where != Where::anywhere) reading_.note_transformation();
}

void DirectiveReader::depart_oddities(const Source& source) {
    for (const Source::Oddity& oddity : source.take_oddities()) {
        for (std::uint64_t i = 0; i < oddity.times; ++i)
            reading_.warn_or_refuse({&source, oddity.offset}, oddity.what, oddity.instead);
    }
}

bool DirectiveReader::stands_here(const Entry& entry) {
    const bool early = entry.where == Where::world_only && stage_ == Stage::options;
    const bool late = entry.where == Where::options_only && stage_ == Stage::world;
    if (!early && !late) return true;
    reading_.warn_or_refuse(place_,
                            fmt::format("{} is {} WorldBegin; put it {} it", entry.name,
                                        early ? "before" : "after", early ? "after" : "before"),
                            "it is left out");
    skip_arguments();
    return false;
}

// Skips to the next directive.
void DirectiveReader::skip_arguments() {
    using Kind = Token::Kind;
    for (bool list = false; tokens().peek().kind != Kind::end; tokens().next()) {
        const Token& token = tokens().peek();
        const bool truth = token.text == "true" || token.text == "false";
        if (token.kind == Kind::word && !list && !truth) return;
        if (token.kind == Kind::open) list = true;
        if (token.kind == Kind::close) list = false;
    }
}

void DirectiveReader::finish() {
    if (stage_ == Stage::options) fail(place_, "the file ends without WorldBegin");
    close_blocks("the end of the file");
    const auto seen = [&](std::string_view what) { return std::ranges::find(seen_, what) != seen_.end(); };
    Draft& draft = reading_.draft;
    keep_options();
    if (!seen("Camera")) {
        reading_.warn(place_,
                      "no Camera: a perspective camera at the origin is used, fov 90, looking along +z");
    }
    if (!seen("Film")) {
        reading_.warn(place_,
                      fmt::format("no Film: {} x {} pixels are used", draft.film.width, draft.film.height));
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
    settle_lens(draft);
    // Options of the integrator and of the command line change the world by these values.
    draft.world.directives.add(draft.film.colours.name());
    draft.world.directives.add(draft.unit ? unit_name(*draft.unit) : "");
    draft.world.directives.add(int{draft.occlusion});
    draft.world.directives.add(int{reading_.old_dialect});
}

void DirectiveReader::keep_options() {
    options_ = {};
    options_.sources = draft_.sources;
    options_.camera = draft_.camera;
    options_.frame_aspect_ratio = draft_.frame_aspect_ratio;
    options_.lens = draft_.lens;
    options_.film = draft_.film;
    options_.film_diagonal = draft_.film_diagonal;
    options_.film_of_version4 = draft_.film_of_version4;
    options_.spp = draft_.spp;
    options_.passes = draft_.passes;
    options_.integrator = draft_.integrator;
    options_.occlusion = draft_.occlusion;
    options_.unit = draft_.unit;
    options_.view = draft_.view;
    options_.world = before_world_;
    if (!more()) return;
    options_.media = draft_.media;
    options_.camera_medium = draft_.camera_medium;
    options_.uses_media = draft_.camera_medium != kNoMedium;
}

// Scales the crop to another image size.
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
    const std::filesystem::path file = reading_.resolve(name);  // belongs to no part, as its directives do
    for (const Open& open : files_) {
        if (open.source->name() == file.string()) {
            fail(place_, "{} \"{}\": the file includes itself", name_, shown(name));
        }
    }
    if (files_.size() > kDeepestInclude) {
        fail(place_, "{} \"{}\": included files are nested more than {} deep", name_, shown(name),
             kDeepestInclude);
    }
    if (++includes_ > kMostIncludes) {
        fail(place_, "{} \"{}\": more than {} included files, the limit", name_, shown(name), kMostIncludes);
    }
    if (import) begin_block();
    const Source& source = source_of(file, name);
    files_.push_back({&source, Tokens(source), import});
}

// Reads each file once, however often it is included.
const Source& DirectiveReader::source_of(const std::filesystem::path& file, const std::string& name) {
    if (const auto known = known_files_.find(file.string()); known != known_files_.end()) {
        text_again_ += known->second->text().size();
        if (text_again_ <= kMostTextAgain) return *known->second;
        fail(place_, "{} \"{}\": repeatedly included files exceed {} MiB of text, the limit", name_,
             shown(name), kMostTextAgain >> 20);
    }
    std::string text;
    std::error_code status;
    const bool empty =
        std::filesystem::is_regular_file(file, status) && std::filesystem::is_empty(file, status);
    if (empty) reading_.warn(place_, fmt::format("{} \"{}\": the file is empty", name_, shown(name)));
    try {
        if (!empty) text = read_text(file);
    } catch (const InputError& error) {
        fail_always(place_, "{} \"{}\": {}", name_, shown(name), printable(error.what()));
    }
    reading_.draft.sources.push_back(std::make_shared<const Source>(file.string(), std::move(text)));
    return *(known_files_[file.string()] = reading_.draft.sources.back().get());
}

void DirectiveReader::close_file() {
    const bool closes_block = files_.back().closes_block;
    depart_oddities(*files_.back().source);
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
        fail(at, "{} expects {} in quotes here, not \"{}\"", name_, what,
             token.kind == Token::Kind::end ? "the end of the file" : shown(token.text));
    }
    std::string value = string_value(token, at);
    if (reading_.part) reading_.part->directives.add(value);
    return value;
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
    if (bracket && count == 16 && pass_wrong_list(values)) return {};
    if (values.size() != count || (bracket && rest.kind != Token::Kind::close)) {
        fail(tokens().place(), "{} expects {} numbers, {}; found \"{}\" after {}", name_, count, what,
             rest.kind == Token::Kind::end ? "the end of the file" : shown(rest.text), values.size());
    }
    if (bracket) tokens().next();
    return values;
}

// Tells whether a complete list has another number of values than the 16 of a matrix; if so, skips and
// reports it.
bool DirectiveReader::pass_wrong_list(const std::vector<double>& values) {
    std::size_t count = values.size();
    for (; tokens().peek().kind == Token::Kind::number; ++count) tokens().next();
    if (count == 16 || tokens().peek().kind != Token::Kind::close) return false;
    tokens().next();
    reading_.warn_or_refuse(place_,
                            fmt::format("{} has {} numbers; expected 16, a matrix by columns", name_, count),
                            "it is left out");
    return true;
}

Params DirectiveReader::parameters(std::string_view kind, std::string_view target) {
    const bool ours = target == "surface" || (target == "light" && is_own_light(kind)) ||
                      (target == "shape" && is_own_shape(kind));
    Params params =
        Params::read(tokens(), fmt::format("{} \"{}\"", name_, shown(kind)), place_, reading_.leniency, ours);
    // A list may continue after the end of the included file in which it begins.
    while (tokens().peek().kind == Token::Kind::end && files_.size() > 1 && !files_.back().closes_block) {
        close_file();
        params.read_more(tokens());
    }
    if (reading_.part) params.add_to(reading_.part->directives);
    params.take_colours_in(reading_.state.colour_space);
    if (const auto& attributes = reading_.state.attributes) {
        const auto defaults = attributes->find(target);
        if (defaults != attributes->end()) params.add_defaults(defaults->second);
    }
    return params;
}

// ---- blocks

void DirectiveReader::begin_block() {
    draft_.world.directives.add("(");
    saved_.push_back({name_, place_, reading_.state});
}

bool DirectiveReader::end_block(std::string_view opening) {
    const auto begun = std::find_if(saved_.rbegin(), saved_.rend(),
                                    [&](const Saved& saved) { return saved.directive == opening; });
    if (begun == saved_.rend()) {
        reading_.warn_or_refuse(place_, fmt::format("{} without {}", name_, opening), "it is left out");
        return false;
    }
    draft_.world.directives.add(")");
    draft_.world.directives.add(opening);
    while (saved_.back().directive != opening) {
        const Saved& last = saved_.back();
        const bool object_goes_on = last.directive == "ObjectBegin";
        reading_.warn_or_refuse(place_,
                                fmt::format("{} closes the {} of {}; blocks must nest", name_, last.directive,
                                            to_string(last.place.location())),
                                object_goes_on ? "the object continues" : "both end here");
        if (object_goes_on) return end_block_around_object(opening);
        saved_.pop_back();
    }
    Saved& last = saved_.back();
    if (opening == "TransformBegin") {
        reading_.state.ctm = last.state.ctm;
    } else {
        reading_.state = std::move(last.state);
    }
    saved_.pop_back();
    return true;
}

// Ends a block that overlaps an object as versions 1 to 3 do with their single stack for all blocks: the end
// of the block restores what the object changed, and the end of the object what the block changed.
bool DirectiveReader::end_block_around_object(std::string_view opening) {
    const auto block = std::find_if(saved_.rbegin(), saved_.rend(),
                                    [&](const Saved& saved) { return saved.directive == opening; });
    Saved& object = saved_.back();
    std::swap(block->state, object.state);
    if (opening == "TransformBegin") {
        reading_.state.ctm = block->state.ctm;
    } else {
        reading_.state = block->state;
    }
    saved_.erase(std::prev(block.base()));
    return true;
}

void DirectiveReader::close_blocks(std::string_view before) {
    while (!saved_.empty()) {
        const Saved& last = saved_.back();
        reading_.warn_or_refuse(last.place,
                                fmt::format("this {} is not ended before {}", last.directive, before),
                                "it ends there");
        // An object that the beginning of another one has ended is complete; only its block is still open.
        if (last.directive == "ObjectBegin" && reading_.object) complete_object();
        saved_.pop_back();
    }
}

void DirectiveReader::concatenate(const M44d& m, std::string_view what) {
    const M44d product = then(m, reading_.state.ctm);
    if (!is_finite(product)) {
        return reading_.warn_or_refuse(
            place_, fmt::format("{} {}: expected a finite transformation", name_, what), "it is left out");
    }
    if (!reading_.state.at_start) return;
    // A singular transformation flattens shapes, which remain visible; directives that need its inverse
    // report that themselves.
    if (inverse(reading_.state.ctm) && !inverse(product)) {
        reading_.warn_or_refuse(
            place_,
            fmt::format("{} {}: not invertible; expected an invertible, affine transformation", name_, what),
            "shapes are converted to triangles and flattened");
    }
    reading_.state.ctm = product;
}

}  // namespace lucerna
