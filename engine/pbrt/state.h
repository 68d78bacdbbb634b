// The graphics state at a point of the scene text, and functions that the readers of single directives share.
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

// An AreaLightSource before a shape uses it.
struct AreaLight {
    Place place;
    Rgb radiance{1.0F};  // with scale applied
    double power = 0;    // W; 0: determined by the radiance
    bool two_sided = false;
    std::shared_ptr<const MeasuredSettings> lamp = {};  // a measured lamp that replaces all of the above
    std::string group = {};                             // as DraftLight::group
    std::optional<BandSpectrum> spectrum = {};          // as DraftLight::spectrum
};

// A material, and its index in the draft once a surface uses it.
struct MaterialEntry {
    Material material;
    std::optional<std::uint32_t> index;
};

// A texture, and its value if it is constant, as nested textures require.
struct NamedTexture {
    RgbTexture texture = RgbTexture::constant(Rgb(0.0F));
    std::optional<Rgb> constant;
    float largest = 0;  // over all channels and places
};

// Defaults of the Attribute directive, by target.
using AttributeDefaults = std::map<std::string, ParamDefaults, std::less<>>;

// The state that AttributeBegin saves.
struct GraphicsState {
    M44d ctm;  // world from object
    bool reverse_orientation = false;
    bool at_start = true;  // transformations are those at the start of a movement (ActiveTransform)
    std::shared_ptr<MaterialEntry> material;
    std::shared_ptr<const AreaLight> area_light;
    MediumInterface media;                      // indices into Draft::media
    const ColourSpace* colour_space = nullptr;  // space of the text's rgb numbers; null: linear sRGB
    // Shared by all blocks with the same defaults, as there may be many. Null: none.
    std::shared_ptr<const AttributeDefaults> attributes;
};

struct Reading {
    Draft& draft;
    Monitor& monitor;
    Leniency leniency;
    std::filesystem::path folder;  // folder of the main scene file, from which relative names start

    std::map<std::string, NamedTexture, std::less<>> textures = {};  // of colours
    std::map<std::string, FloatTexture, std::less<>> float_textures = {};
    std::map<std::string, std::shared_ptr<MaterialEntry>, std::less<>> materials = {};
    std::shared_ptr<TextureImages> images = std::make_shared<TextureImages>();
    // Coat tables by index and alphas (-1: any), shared by the materials of one scene.
    std::map<std::array<float, 3>, std::shared_ptr<const CoatTable>> covers = {};
    std::map<std::string, std::int32_t, std::less<>> media = {};  // indices in the draft, by name
    GraphicsState state = {};
    DraftObject* object = nullptr;        // between ObjectBegin and ObjectEnd; receives shapes
    const NamedMeshes* meshes = nullptr;  // null: none
    bool skip_missing = false;  // a missing file removes a mesh or makes a texture grey, with a warning
    // The text has shown features of versions 1 and 2, which have defaults of their own.
    bool old_dialect = false;
    Place place = {};  // of the current directive
    // The spectrum of the light's colour that was read last, per lumen; none if it is not known.
    std::optional<BandSpectrum> light_spectrum = {};
    SceneText* part = nullptr;  // part of the draft to which that directive belongs; null: to none

    // Returns the working space of the render, in which colours are read.
    const WorkingSpace& colours() const { return draft.film.colours; }
    // Resolves a file name of the scene's text. All file names pass through this function.
    std::filesystem::path resolve(const std::string& name);
    // Records that the current directive depends on the transformation.
    void note_transformation() const { part->directives.add_bytes(std::as_bytes(std::span(&state.ctm, 1))); }
    DraftShapes& shapes() const { return object ? object->shapes : draft; }
    // Report behaviour that pbrt shares, and departures from the text; see tokens.h.
    void warn(const Place& at, std::string_view message) { leniency.warn(at, message); }
    void warn_or_refuse(const Place& at, std::string_view what, std::string_view instead,
                        std::string_view lost = {}) {
        leniency.warn_or_refuse(at, what, instead, lost);
    }
};

// A measured medium: reduced scattering and absorption, 1/mm.
struct MeasuredMedium {
    std::string_view name;
    Rgb sigma_s, sigma_a;
};
// Finds a medium by name, ignoring case; null if unknown.
const MeasuredMedium* measured_medium(std::string_view name);
// Returns "did you mean ...? ... are accepted" for messages.
std::string accepted_measured_media(std::string_view instead_of);

// One reader per kind of directive, each in the file of its name. `kind` is the quoted word after the
// directive.
void read_shape(Reading& reading, const std::string& kind, Params& params);
void read_calculation_surface(Reading& reading, const std::string& name, Params& params);
// Returns a material named after its kind.
Material read_material(Reading& reading, const std::string& kind, Params& params);
NamedTexture read_texture(Reading& reading, const std::string& kind, Params& params);
FloatTexture read_float_texture(Reading& reading, const std::string& kind, Params& params);
void read_light(Reading& reading, const std::string& kind, Params& params);
std::shared_ptr<const AreaLight> read_area_light(Reading& reading, const std::string& kind, Params& params);
void read_camera(Reading& reading, const std::string& kind, Params& params);
// Reads the camera "realistic"; settle_lens() applies it once the film is known.
void read_realistic(Reading& reading, Params& params);
void settle_lens(Draft& draft);
// Reads MakeNamedMedium of every kind.
void read_named_medium(Reading& reading, const std::string& name, Params& params);
// Reads Volume of versions 1 and 2, a medium in a box.
void read_volume(Reading& reading, const std::string& kind, Params& params);
MediumInterface read_medium_interface(Reading& reading, const Place& at, const std::string& inside,
                                      const std::string& outside);
// Replaces media that are named but never made by clear space.
void settle_media(Reading& reading);
void read_film(Reading& reading, const std::string& kind, Params& params);
void read_filter(Reading& reading, const std::string& kind, Params& params);
void read_sampler(Reading& reading, const std::string& kind, Params& params);
// Reads the settings of the scene's integrator, or of the one that `override_name` replaces it with.
IntegratorSettings read_integrator(Reading& reading, const std::string& kind, Params& params,
                                   const std::string& override_name);
void apply_settings(IntegratorSettings& settings, const SceneOverrides& overrides);

// The meaning of a colour. It decides how a spectrum becomes red, green and blue, and whether these are a
// ratio or light of the working space (working_space.h).
enum class ColorUse : std::uint8_t {
    ratio,     // reflectance, eta, k, sigma: 1 at all wavelengths is (1, 1, 1)
    tint,      // colour of a light whose strength is given elsewhere; a spectrum of 1 has luminance 1
    emission,  // radiance or intensity of a light, in the scene's unit
};
// Converts three numbers of an rgb parameter, not negative, from their space to the working space. A colour
// outside its gamut is mixed with grey of its luminance, with a warning.
Rgb rgb_of_numbers(const Reading& reading, const Params& params, const Param& param, const V3d& numbers,
                   ColorUse use);

// Reads one colour of any spelling: rgb, color, xyz, blackbody, spectrum (samples, a name, a .spd file).
// Returns nothing if the parameter is absent; rejects a texture. Numbers of emission are unchanged (a
// constant spectrum of value c has luminance c). Named illuminants and a blackbody of one number have
// luminance 1; the second of two numbers is the largest spectral value (spectra.cpp says why). In a
// photometric scene samples are in W/(m² sr nm), and their emission is 683 lm/W ∫ s V dλ (cd/m²).
std::optional<Rgb> read_spectrum(Reading& reading, Params& params, std::string_view name, ColorUse use);

// Reads a number that may vary: a float, or the name of a texture of floats.
FloatTexture read_float(Reading& reading, Params& params, std::string_view name, double fallback);

// Reads a reflectance: a colour of any spelling, or the name of a texture. Channels above 1 are set to 1,
// with a warning; those of a texture are left to the lookup.
RgbTexture read_color(Reading& reading, Params& params, std::string_view name, const Rgb& fallback);

}  // namespace lucerna
