// What holds at a point of the scene text, and what the readers of single directives share.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/pbrt/draft.h"
#include "engine/pbrt/object_mesh.h"
#include "engine/pbrt/params.h"
#include "engine/pbrt/tokens.h"
#include "engine/pbrt/transforms.h"
#include "engine/scene/texture_image.h"

namespace lucerna {

// AreaLightSource, until a shape takes it up.
struct AreaLight {
    Place place;
    Rgb radiance{1.0F};  // scale applied
    double power = 0;    // W; 0: as the radiance says
    bool two_sided = false;
    std::shared_ptr<const MeasuredSettings> lamp = {};  // a measured lamp, in place of all the above
    std::string group = {};                             // DraftLight's
};

// A material, and where in the draft it stands once a surface uses it.
struct MaterialEntry {
    Material material;
    std::optional<std::uint32_t> index;
};

// A texture, and its value if it is the same everywhere (what textures of textures need).
struct NamedTexture {
    RgbTexture texture = RgbTexture::constant(Rgb(0.0F));
    std::optional<Rgb> constant;
    float largest = 0;  // of all channels, everywhere
};

// Defaults that the Attribute directive gave, by target.
using AttributeDefaults = std::map<std::string, ParamDefaults, std::less<>>;

// Saved by AttributeBegin.
struct GraphicsState {
    M44d ctm;  // world from object
    bool reverse_orientation = false;
    bool at_start = true;  // transformations are those of the start of a movement (ActiveTransform)
    std::shared_ptr<MaterialEntry> material;
    std::shared_ptr<const AreaLight> area_light;
    MediumInterface media;                      // indices into Draft::media
    const ColourSpace* colour_space = nullptr;  // of the text's rgb numbers; null: linear sRGB
    // Shared by all that have the same, as blocks may be many. Null: none.
    std::shared_ptr<const AttributeDefaults> attributes;
};

struct Reading {
    Draft& draft;
    Monitor& monitor;
    Leniency leniency;
    std::filesystem::path folder;  // of the main scene file: what relative names start from

    std::map<std::string, NamedTexture, std::less<>> textures = {};  // of colours
    std::map<std::string, FloatTexture, std::less<>> float_textures = {};
    std::map<std::string, std::shared_ptr<MaterialEntry>, std::less<>> materials = {};
    std::shared_ptr<TextureImages> images = std::make_shared<TextureImages>();
    // What varnish of this index and these alphas (-1: any) reflects, shared by the materials of one scene.
    std::map<std::array<float, 3>, std::shared_ptr<const CoatTable>> covers = {};
    std::map<std::string, std::int32_t, std::less<>> media = {};  // in the draft, by name
    GraphicsState state = {};
    DraftObject* object = nullptr;        // between ObjectBegin and ObjectEnd: where shapes go
    const NamedMeshes* meshes = nullptr;  // null: none
    bool skip_missing = false;  // a mesh whose file is missing is left out, a texture grey, with a warning
    // Versions 1 and 2, as far as the text has shown: they have defaults of their own.
    bool old_dialect = false;
    Place place = {};           // of the directive at hand
    SceneText* part = nullptr;  // of the draft, to which that directive belongs; null: to neither

    // The space that the render is in; colours are read as ratios and light of it.
    const WorkingSpace& colours() const { return draft.film.colours; }
    // The file that the scene's text names. All of them come this way.
    std::filesystem::path resolve(const std::string& name);
    // The directive at hand depends on the transformation.
    void note_transformation() const { part->directives.add_bytes(std::as_bytes(std::span(&state.ctm, 1))); }
    DraftShapes& shapes() const { return object ? object->shapes : draft; }
    // What pbrt does as well, and what departs from the text; see tokens.h.
    void warn(const Place& at, std::string_view message) { leniency.warn(at, message); }
    void depart(const Place& at, std::string_view what, std::string_view instead,
                std::string_view lost = {}) {
        leniency.depart(at, what, instead, lost);
    }
};

// A medium that somebody has measured: reduced scattering and absorption, 1/mm.
struct MeasuredMedium {
    std::string_view name;
    Rgb sigma_s, sigma_a;
};
// By name, whatever its case; null if unknown.
const MeasuredMedium* measured_medium(std::string_view name);
// "did you mean ...? ... are accepted", for messages.
std::string accepted_measured_media(std::string_view instead_of);

// One reader per kind of directive; each in the file of its name. `kind` is the quoted word after the
// directive.
void read_shape(Reading& reading, const std::string& kind, Params& params);
void read_calculation_surface(Reading& reading, const std::string& name, Params& params);
// Named after its kind.
Material read_material(Reading& reading, const std::string& kind, Params& params);
NamedTexture read_texture(Reading& reading, const std::string& kind, Params& params);
FloatTexture read_float_texture(Reading& reading, const std::string& kind, Params& params);
void read_light(Reading& reading, const std::string& kind, Params& params);
std::shared_ptr<const AreaLight> read_area_light(Reading& reading, const std::string& kind, Params& params);
void read_camera(Reading& reading, const std::string& kind, Params& params);
// The camera "realistic", and what it is once the film is known.
void read_realistic(Reading& reading, Params& params);
void settle_lens(Draft& draft);
// MakeNamedMedium, whatever its kind.
void read_named_medium(Reading& reading, const std::string& name, Params& params);
// Versions 1 and 2's Volume: a medium in a box.
void read_volume(Reading& reading, const std::string& kind, Params& params);
MediumInterface read_medium_interface(Reading& reading, const Place& at, const std::string& inside,
                                      const std::string& outside);
// A medium whose name was used and never made is clear space.
void settle_media(Reading& reading);
void read_film(Reading& reading, const std::string& kind, Params& params);
void read_filter(Reading& reading, const std::string& kind, Params& params);
void read_sampler(Reading& reading, const std::string& kind, Params& params);
// Settings of the integrator that the scene names, or of the one that `name` puts in its place.
IntegratorSettings read_integrator(Reading& reading, const std::string& kind, Params& params,
                                   const std::string& override_name);
void apply_settings(IntegratorSettings& settings, const SceneOverrides& overrides);

// What a colour stands for, which decides how a spectrum becomes red, green and blue, and whether these are a
// ratio or light of the working space (working_space.h).
enum class ColorUse : std::uint8_t {
    ratio,     // reflectance, eta, k, sigma: 1 at all wavelengths is (1, 1, 1)
    tint,      // of a light whose strength something else gives; a spectrum of 1 has luminance 1
    emission,  // radiance or intensity of a light, in the scene's unit
};
// Three numbers of an rgb parameter, not negative, in the working space whatever space they are in. A colour
// outside its gamut is mixed with grey of its luminance, with a warning.
Rgb rgb_of_numbers(const Reading& reading, const Params& params, const Param& param, const V3d& numbers,
                   ColorUse use);

// One colour, however it is spelt: rgb, color, xyz, blackbody, spectrum (samples, a name, a .spd file).
// Nothing if the parameter is absent; a texture is an error. Strength of emission: numbers as they stand (a
// constant spectrum of value c has luminance c); luminance 1 for a named illuminant and for a blackbody of
// one number, of two the second is its largest spectral value (spectra.cpp says why). In a photometric scene
// a spectrum of samples is in W/(m² sr nm), and its emission 683 lm/W ∫ s V dλ (cd/m²).
std::optional<Rgb> read_spectrum(Reading& reading, Params& params, std::string_view name, ColorUse use);

// A number that may vary: a float, or the name of a texture of floats.
FloatTexture read_float(Reading& reading, Params& params, std::string_view name, double fallback);

// A reflectance: a colour however spelt, or the name of a texture. Channels above 1 are taken as 1, with a
// warning; those of a texture are left to whoever looks it up.
RgbTexture read_color(Reading& reading, Params& params, std::string_view name, const Rgb& fallback);

}  // namespace lucerna
