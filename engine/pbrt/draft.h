// A scene as its text describes it, in world space and double precision, before anything is built.
//
// The reader fills a Draft line by line. assemble() then chooses the scene's origin, moves everything there
// and makes the float32 geometry, the lights and the camera, so nothing is rounded before the move.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/base/vec.h"
#include "engine/colour/rendition.h"
#include "engine/pbrt/params.h"
#include "engine/pbrt/tokens.h"
#include "engine/render/job.h"
#include "engine/scene/calculation_surface.h"
#include "engine/scene/material.h"
#include "engine/scene/medium.h"
#include "engine/scene/mesh.h"
#include "engine/scene/scene.h"
#include "lights/analytic.h"
#include "lights/image_lights.h"
#include "lights/measured.h"
#include "lights/photometric.h"

namespace lucerna {

struct SceneOverrides;

// In world space with unit normals `n`. Traits are those of Mesh.
struct DraftMesh {
    std::vector<V3d> p;
    std::vector<V3i> triangles;
    std::vector<V3f> n;
    std::vector<V2f> uv;
    SurfaceTraits traits;
};

// In world space, otherwise like BilinearMesh and Curves.
struct DraftPatches {
    std::vector<V3d> p;
    std::vector<std::array<std::int32_t, 4>> patches;
    std::vector<V3f> n;
    std::vector<V2f> uv;
    SurfaceTraits traits;
};
struct DraftCurves {
    Curves::Kind kind = Curves::Kind::flat;
    std::vector<V3d> p;         // four per segment
    std::vector<float> radius;  // one per point
    std::vector<V3f> n;         // one per point of a ribbon
    std::vector<Curves::Segment> segments;
    SurfaceTraits traits;
};
struct DraftShapes {
    std::vector<DraftMesh> meshes;
    std::vector<Quadric> quadrics;  // world_from_object in world space
    std::vector<DraftPatches> patches;
    std::vector<DraftCurves> curves;

    bool empty() const { return meshes.empty() && quadrics.empty() && patches.empty() && curves.empty(); }
};

// An object holds the contents of ObjectBegin and ObjectEnd; an instance places it. As in pbrt, the
// transformations within an object stay, and the instance's is applied after them.
struct DraftInstance {
    std::size_t object;
    M44d world_from_world;
};
struct DraftObject {
    DraftShapes shapes;
    std::vector<DraftInstance> instances;  // instances of previously completed objects
    // Number of objects with shapes that an instance of this one shows, at all depths; saturates.
    std::uint64_t shown = 0;
    int depth = 0;  // nesting depth of objects in it
};

// Lights before the origin is known, with positions in world space.
struct PointSpec {
    V3d position;
    Rgb intensity;  // W/sr
};
struct SpotSpec {
    V3d position, axis;
    Rgb intensity;  // W/sr
    double cone_degrees, delta_degrees;
    SpotFalloff falloff = SpotFalloff::smoothstep;
};
struct DistantSpec {
    V3d direction;  // direction in which light travels
    Rgb irradiance;
};
struct InfiniteSpec {
    Rgb radiance;
};
// The images have frames of their own, which `axes` places in the world.
struct ImageInfiniteSpec {
    std::shared_ptr<const DirectionalImage> image;
    LightAxes axes;
    Rgb scale;                           // W/(m² sr)
    FluxUnit own_unit = FluxUnit::watt;  // where the scene states none
};
// The sun of a sky, which counts in lumens where the scene states no unit.
struct SunSpec {
    V3d towards;     // unit
    Rgb irradiance;  // of a plane that faces it [W/m²]
};
struct GoniometricSpec {
    V3d position;
    LightAxes axes;
    std::shared_ptr<const DirectionalImage> image;
    Rgb scale;  // W/sr
};
struct ProjectionSpec {
    V3d position;
    LightAxes axes;
    std::shared_ptr<const Slide> slide;
    Rgb scale;  // W/sr
};
struct PhotometricSpec {
    std::string_view kind;  // "photometric", "ies" or "ldt"
    V3d position;
    LightAxes axes;
    double metre;                               // length of the file's metre in the world
    std::shared_ptr<const PhotometricWeb> web;  // without an opening if the lamp shines from a point
    Rgb scale;                                  // multiplies the candela of the web
};
struct MeasuredSpec {
    MeasuredSettings settings;  // world_from_light not yet relative to the origin
    // A part of the lamp in its file, which is all that emits. Null: the lamp itself.
    std::shared_ptr<const Lumigraph> part = {};
};
struct RayFileSpec {
    RayLightSettings settings;  // relative to the world, not yet to the origin
};
// An area light that coincides with another one and is part of its light.
struct CoincidentEmission {
    Rgb radiance;
    bool two_sided;
    bool turned;   // its emitting side is the other light's back
    double power;  // like DraftLight::power
};
// A light that emits from a surface of the draft.
struct AreaSpec {
    enum class Surface : std::uint8_t { mesh, quadric } surface;
    std::size_t index;
    Rgb radiance;
    bool two_sided;
    bool unseen;                                        // rays pass through the surface
    std::shared_ptr<const MeasuredSettings> lamp = {};  // a measured lamp that replaces the emission above
    std::vector<CoincidentEmission> coincident = {};
};

struct DraftLight {
    Place place;
    std::variant<PointSpec, SpotSpec, DistantSpec, InfiniteSpec, ImageInfiniteSpec, SunSpec, GoniometricSpec,
                 ProjectionSpec, PhotometricSpec, MeasuredSpec, RayFileSpec, AreaSpec>
        spec;
    double power = 0;                 // > 0 scales the light to this luminous power, in its unit
    std::string group = {};           // "lightgroup"; empty: none
    std::filesystem::path file = {};  // file of the lamp; empty: none
    // Spectral flux per lumen of what the light emits [W/(nm lm)]. None: not known, or several
    // (MeasuredSpec).
    std::optional<BandSpectrum> spectrum = {};
};

// A medium, which is not set while only its name is known.
struct DraftMedium {
    Place place;
    std::string name;
    std::optional<Medium> medium;  // medium_from_scene is not set
    M44d world_from_medium;
};

// A camera of real lenses as a thin lens; lengths in metres, the unit of its camera space.
struct RealisticLens {
    double radius = 0, film_distance = 0, focus_distance = 0;
    double film_diagonal = 0;  // 0: the film's own
    bool weighted = false;     // the film measures exposure instead of radiance
};

struct Draft : DraftShapes {
    // Places point into these sources, which the frames of one file share.
    std::vector<std::shared_ptr<const Source>> sources;
    std::vector<std::filesystem::path> files;   // files that the text names, in order, possibly repeated
    std::vector<std::filesystem::path> caches;  // caches kept beside these files
    SceneText world, view;                      // for Job

    std::vector<std::unique_ptr<DraftObject>> objects;
    std::vector<DraftInstance> instances;
    std::vector<Material> materials;
    std::vector<DraftLight> lights;
    std::vector<DraftMedium> media;
    std::vector<std::uint32_t> regions;      // indices of media that fill a region of space
    std::int32_t camera_medium = kNoMedium;  // index into media
    bool uses_media = false;                 // some path may enter a medium

    Camera::Settings camera;        // world_from_camera in world space; size not yet set
    double frame_aspect_ratio = 0;  // 0: the film's
    std::optional<RealisticLens> lens;
    double film_diagonal = 0.035;  // m
    bool film_of_version4 = false;
    FilmSettings film;
    int spp = 16;
    int passes = 0;  // requested passes of an integrator that works in passes; 0: as many as `spp` takes
    IntegratorSettings integrator;
    std::vector<CalculationSurface> surfaces;  // in world space
    FarFieldOf far_field;                      // SceneOverrides::far_field
    LampFileOf lamp_file;                      // SceneOverrides::lamp_file
    bool without_sun = false;                  // SceneOverrides::without_sun
    // Renders ambient occlusion: every surface is white, and a uniform sky of radiance 1 is the only light.
    bool occlusion = false;
    std::optional<FluxUnit> unit;  // unit of all light that the scene or the command line states
};

// Reads the first frame of the text with all included files. Throws InputError.
Draft read_draft(std::string text, const std::filesystem::path& pretended_file,
                 const SceneOverrides& overrides, Monitor& monitor);

// The parts of a Scene, relative to parts.origin.
struct Assembled {
    SceneParts parts;
    Camera::Settings camera;
    std::vector<std::string> light_places;  // place in the text of each light of the parts
};
// Builds the parts and frees shapes of the draft one by one.
Assembled assemble(Draft draft, const Workers& workers, Monitor& monitor);

// Merges area lights on the same surface into one light with the sum of their radiance and one surface,
// because a ray meets only one of the surfaces. Warns of each.
void merge_coincident_lights(Draft& draft, Monitor& monitor);
// Replaces measured lamps by a light for each of their spectra, so that each light has one. Throws TextError
// at the place of a light whose spectrum is not known.
void split_by_spectra(Draft& draft, Monitor& monitor);
// Warns of lights whose surfaces overlap in part or in a way that did not merge them.
void warn_of_overlapping_lights(const Scene& scene, const std::vector<std::string>& places,
                                const Workers& workers, Monitor& monitor);

// The functions below turn the shapes of a draft into those of a scene or a prototype.

Box3d bounds_of(const DraftShapes& shapes);

// Moves shapes to `origin`. Small shapes of equal traits are joined, so that a scene of many tiny ones has
// few geometries; shapes that emit stay separate. `mesh_of` receives the index of each mesh.
Shapes build_shapes(DraftShapes draft, const V3d& origin, std::vector<std::size_t>& mesh_of);

// The visible objects and all their instances, with nested instances resolved.
struct Placements {
    struct Object {
        std::size_t index;  // index in the draft
        V3d centre;         // centre of its shapes in the draft's coordinates
    };
    std::vector<Object> objects;
    std::vector<Instance> instances;  // of `objects`, from the draft's coordinates to the world
    Box3d bounds;                     // in the world
};
// Throws InputError if the instances, including nested ones, exceed the memory.
Placements place_objects(const Draft& draft);

// Makes each object a prototype around its own centre, which preserves float32 precision.
void build_prototypes(Draft& draft, const Placements& placements, SceneParts& parts);

}  // namespace lucerna
