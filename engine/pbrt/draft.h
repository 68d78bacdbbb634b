// A scene as its text describes it: in world space and double precision, before anything is built.
//
// The reader fills a Draft line by line; assemble() then finds the scene's origin, moves everything there and
// makes the float32 geometry, the lights and the camera. Between the two nothing has been rounded.
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

// World space; `n` unit. Traits as Mesh has them.
struct DraftMesh {
    std::vector<V3d> p;
    std::vector<V3i> triangles;
    std::vector<V3f> n;
    std::vector<V2f> uv;
    SurfaceTraits traits;
};

// As BilinearMesh and Curves have them, in world space.
struct DraftPatches {
    std::vector<V3d> p;
    std::vector<std::array<std::int32_t, 4>> patches;
    std::vector<V3f> n;
    std::vector<V2f> uv;
    SurfaceTraits traits;
};
struct DraftCurves {
    Curves::Kind kind = Curves::Kind::flat;
    std::vector<V3d> p;         // four for each segment
    std::vector<float> radius;  // one for each of them
    std::vector<V3f> n;         // the same, for a ribbon
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

// What stands between ObjectBegin and ObjectEnd, and where it is put. As in pbrt, the transformations that
// hold within an object stay, and that of the instance comes on top of them.
struct DraftInstance {
    std::size_t object;
    M44d world_from_world;
};
struct DraftObject {
    DraftShapes shapes;
    std::vector<DraftInstance> instances;  // of objects that were complete before
    // Objects with shapes that an instance of this one shows, itself and those within those within it; what
    // is more than a number holds stays that.
    std::uint64_t shown = 0;
    int depth = 0;  // of objects within it
};

// Lights, before the origin is known. Positions in world space.
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
    V3d direction;  // of travel
    Rgb irradiance;
};
struct InfiniteSpec {
    Rgb radiance;
};
// The images know directions in their own frames, of which `axes` tells how they lie in the world.
struct ImageInfiniteSpec {
    std::shared_ptr<const DirectionalImage> image;
    LightAxes axes;
    Rgb scale;  // W/(m² sr)
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
    std::string_view kind;  // "ies" or "ldt"
    V3d position;
    LightAxes axes;
    std::shared_ptr<const PhotometricWeb> web;
    Rgb scale;  // of its candela
};
struct MeasuredSpec {
    MeasuredSettings settings;  // world_from_light not yet relative to the origin
};
struct RayFileSpec {
    RayLightSettings settings;  // likewise
};
// An area light that lies exactly on another one, and is part of its light.
struct CoincidentEmission {
    Rgb radiance;
    bool two_sided;
    bool turned;   // its emitting side is the other one's back
    double power;  // as DraftLight has it
};
// Emits from a surface of the draft.
struct AreaSpec {
    enum class Surface : std::uint8_t { mesh, quadric } surface;
    std::size_t index;
    Rgb radiance;
    bool two_sided;
    bool unseen;                                        // rays pass through the surface
    std::shared_ptr<const MeasuredSettings> lamp = {};  // seen on the surface, in place of the above
    std::vector<CoincidentEmission> coincident = {};
};

struct DraftLight {
    Place place;
    std::variant<PointSpec, SpotSpec, DistantSpec, InfiniteSpec, ImageInfiniteSpec, GoniometricSpec,
                 ProjectionSpec, PhotometricSpec, MeasuredSpec, RayFileSpec, AreaSpec>
        spec;
    double power = 0;                 // if > 0 the light is scaled to this luminous power, in its unit
    std::string group = {};           // "lightgroup"; empty: none
    std::filesystem::path file = {};  // of its light; empty: none
};

// A medium; none yet while only its name has been said.
struct DraftMedium {
    Place place;
    std::string name;
    std::optional<Medium> medium;  // medium_from_scene not set
    M44d world_from_medium;
};

// A camera of real lenses, as a thin one; in metres, which its camera space has.
struct RealisticLens {
    double radius = 0, film_distance = 0, focus_distance = 0;
    double film_diagonal = 0;  // 0: the film's own
    bool weighted = false;     // the film counts what it receives, not radiance
};

struct Draft : DraftShapes {
    // Places point into these; the frames of one file share them.
    std::vector<std::shared_ptr<const Source>> sources;
    std::vector<std::filesystem::path> files;   // that the text names, in order, some more than once
    std::vector<std::filesystem::path> caches;  // kept beside them
    SceneText world, view;                      // Job's

    std::vector<std::unique_ptr<DraftObject>> objects;
    std::vector<DraftInstance> instances;
    std::vector<Material> materials;
    std::vector<DraftLight> lights;
    std::vector<DraftMedium> media;
    std::vector<std::uint32_t> regions;      // of media: those that stand in space
    std::int32_t camera_medium = kNoMedium;  // index into media
    bool uses_media = false;                 // some path may come to be in one

    Camera::Settings camera;        // world_from_camera in world space; no size yet
    double frame_aspect_ratio = 0;  // 0: that of the film
    std::optional<RealisticLens> lens;
    double film_diagonal = 0.035;  // m
    bool film_of_version4 = false;
    FilmSettings film;
    int spp = 16;
    int passes = 0;  // that an integrator which works in passes is asked for; 0: as many as `spp` takes
    IntegratorSettings integrator;
    std::vector<CalculationSurface> surfaces;  // in world space
    FarFieldOf far_field;                      // SceneOverrides'
    LampFileOf lamp_file;                      // SceneOverrides'
    // Ambient occlusion: every surface white, and no light but an even sky of radiance 1.
    bool occlusion = false;
    std::optional<FluxUnit> unit;  // of all light, as the scene or the command line states it
};

// Reads the first frame of the text, and all it includes. Throws InputError.
Draft read_draft(std::string text, const std::filesystem::path& pretended_file,
                 const SceneOverrides& overrides, Monitor& monitor);

// The parts that a Scene is made of, relative to parts.origin.
struct Assembled {
    SceneParts parts;
    Camera::Settings camera;
    std::vector<std::string> light_places;  // where the text has each light of the parts
};
// Shapes of the draft are given up one by one as they are built.
Assembled assemble(Draft draft, const Workers& workers, Monitor& monitor);

// Area lights on one and the same surface: a ray meets only one of the surfaces, so they become one light
// that shines with the sum of their radiance, and one surface. Warns of each.
void merge_coincident_lights(Draft& draft, Monitor& monitor);
// Warns of lights whose surfaces coincide in part, or in another way that did not make them one.
void warn_of_overlapping_lights(const Scene& scene, const std::vector<std::string>& places,
                                const Workers& workers, Monitor& monitor);

// From the shapes of a draft, in world space and double precision, to those of a scene or a prototype.

Box3d bounds_of(const DraftShapes& shapes);

// Moved to `origin`. Small meshes (and curves, and patches) of equal traits become one, so that a scene of
// many tiny shapes has few geometries; one that emits stays alone. `mesh_of` tells where each mesh went.
Shapes build_shapes(DraftShapes draft, const V3d& origin, std::vector<std::size_t>& mesh_of);

// Every object that is shown, and where, instances within objects resolved.
struct Placements {
    struct Object {
        std::size_t index;  // in the draft
        V3d centre;         // of its shapes, where the draft has them
    };
    std::vector<Object> objects;
    std::vector<Instance> instances;  // of `objects`; from where the draft has the shapes to the world
    Box3d bounds;                     // in the world
};
// Throws InputError if instances, with those within them, are more than memory holds.
Placements place_objects(const Draft& draft);

// Each object becomes a prototype around its own centre, so that float32 keeps its bits.
void build_prototypes(Draft& draft, const Placements& placements, SceneParts& parts);

}  // namespace lucerna
