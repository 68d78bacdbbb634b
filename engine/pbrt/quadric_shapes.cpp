// Reads quadrics and disks with pbrt's parameters.
#include <algorithm>
#include <cmath>

#include "engine/pbrt/shapes.h"
#include "engine/scene/quadric.h"

namespace lucerna {
namespace {

using Kind = Quadric::Kind;

// Reads a size. pbrt uses essentially its square, so negative ones are accepted.
float positive(Params& params, std::string_view name, double fallback) {
    const double given = params.real(name, fallback), size = std::fabs(given);
    if (!(size >= 1e-30 && size <= 1e30)) {
        fail(params.place_of(name), "{} of {}: {:g} is not accepted; expected {:g} to {:g}", name,
             params.owner(), given, 1e-30, 1e30);
    }
    if (given < 0) {
        params.warn_or_refuse(params.place_of(name),
                              fmt::format("{} of {}: {:g} is not accepted; expected {:g} to {:g}", name,
                                          params.owner(), given, 1e-30, 1e30),
                              fmt::format("{:g} is used", size));
    }
    return static_cast<float>(size);
}

float phi_max(Params& params) {
    return static_cast<float>(params.real_within("phimax", 360, 1e-3, 360) * (M_PI / 180));
}

Quadric read_sphere(Params& params) {
    Quadric sphere;
    sphere.kind = Quadric::Kind::sphere;
    sphere.radius = positive(params, "radius", 1);
    const double r = static_cast<double>(sphere.radius);
    const double a = params.real("zmin", -r), b = params.real("zmax", r);
    const double low = std::min(a, b), high = std::max(a, b);  // pbrt accepts either order
    if (!(low < r && high > -r && low < high)) {
        fail(params.place_of("zmin"), "zmin {:g} and zmax {:g} leave nothing of a sphere of radius {:g}", a,
             b, r);
    }
    if (low > -r) sphere.z_min = static_cast<float>(low);
    if (high < r) sphere.z_max = static_cast<float>(high);
    sphere.phi_max = phi_max(params);
    return sphere;
}

Quadric read_disk(Params& params) {
    Quadric disk;
    disk.kind = Quadric::Kind::disk;
    disk.radius = positive(params, "radius", 1);
    disk.height = static_cast<float>(params.real_within("height", 0, -1e30, 1e30));
    disk.inner_radius = static_cast<float>(params.real_within("innerradius", 0, 0, 1e30));
    if (!(disk.inner_radius < disk.radius)) {
        fail(params.place_of("innerradius"), "innerradius {:g} is not less than radius {:g}",
             disk.inner_radius, disk.radius);
    }
    disk.phi_max = phi_max(params);
    return disk;
}

Quadric read_cylinder(Params& params) {
    Quadric cylinder;
    cylinder.kind = Kind::cylinder;
    cylinder.radius = positive(params, "radius", 1);
    const double a = params.real_within("zmin", -1, -1e30, 1e30),
                 b = params.real_within("zmax", 1, -1e30, 1e30);
    cylinder.z_min = static_cast<float>(std::min(a, b));  // pbrt accepts either order
    cylinder.z_max = static_cast<float>(std::max(a, b));
    if (!(cylinder.z_min < cylinder.z_max)) {
        fail(params.place_of("zmin"), "zmin {:g} and zmax {:g} leave nothing of a cylinder", a, b);
    }
    cylinder.phi_max = phi_max(params);
    return cylinder;
}

Quadric read_cone(Params& params) {
    Quadric cone;
    cone.kind = Kind::cone;
    cone.radius = positive(params, "radius", 1);
    cone.height = positive(params, "height", 1);
    cone.phi_max = phi_max(params);
    return cone;
}

Quadric read_paraboloid(Params& params) {
    Quadric bowl;
    bowl.kind = Kind::paraboloid;
    bowl.radius = positive(params, "radius", 1);
    const double a = params.real_within("zmin", 0, -1e30, 1e30),
                 b = params.real_within("zmax", 1, -1e30, 1e30);
    const double low = std::max(0.0, std::min(a, b)), high = std::max(a, b);  // the surface begins at z = 0
    bowl.z_min = static_cast<float>(low);
    bowl.z_max = static_cast<float>(high);
    if (!(bowl.z_min < bowl.z_max)) {
        fail(params.place_of("zmin"), "zmin {:g} and zmax {:g} leave nothing of a paraboloid", a, b);
    }
    bowl.phi_max = phi_max(params);
    return bowl;
}

Quadric read_hyperboloid(Params& params) {
    Quadric waist;
    waist.kind = Kind::hyperboloid;
    waist.p1 = V3f(params.point("p1", V3d(0, 0, 0)));
    waist.p2 = V3f(params.point("p2", V3d(1, 1, 1)));
    if (waist.p2.z == 0) std::swap(waist.p1, waist.p2);  // as in pbrt, which flips the normal
    if (waist.p1.z == waist.p2.z) {
        fail(params.place_of("p1"), "p1 and p2 have the same z, {:g}; use a disk for a flat ring",
             waist.p1.z);
    }
    waist.phi_max = phi_max(params);
    return waist;
}

Quadric read_quadric(const std::string& kind, Params& params) {
    if (kind == "disk") return read_disk(params);
    if (kind == "cylinder") return read_cylinder(params);
    if (kind == "cone") return read_cone(params);
    if (kind == "paraboloid") return read_paraboloid(params);
    if (kind == "hyperboloid") return read_hyperboloid(params);
    return read_sphere(params);
}

// Tells whether the emission has a closed form: the quadric is a complete sphere or disk with uniform scale.
bool emits_exactly(const Quadric& quadric) {
    if (quadric.kind != Kind::sphere && quadric.kind != Kind::disk) return false;
    const bool whole =
        quadric.phi_max >= 2 * kPi - 1e-4F && !std::isfinite(quadric.z_min) && !std::isfinite(quadric.z_max);
    return whole && uniform_scale(quadric.world_from_object);
}

}  // namespace

ObjectMesh tessellated(const Quadric& given) {
    Quadric quadric = given;
    quadric.world_from_object = M44d();
    quadric.traits = {};
    const QuadricShape shape(quadric);
    constexpr float kSectors = 128;  // of a full turn
    const int sectors = std::max(1, static_cast<int>(std::ceil(kSectors * quadric.phi_max / (2 * kPi))));
    const bool straight =
        quadric.kind == Kind::disk || quadric.kind == Kind::cylinder || quadric.kind == Kind::cone;
    const int rings = straight ? 1 : 32;
    ObjectMesh mesh;
    for (int j = 0; j <= rings; ++j) {
        for (int i = 0; i <= sectors; ++i) {
            const QuadricShape::Surface at =
                shape.at(static_cast<double>(i) / sectors, static_cast<double>(j) / rings);
            mesh.p.push_back(at.p);
            mesh.n.push_back(at.n);
            mesh.uv.push_back(at.uv);
        }
    }
    for (int j = 0; j < rings; ++j) {
        for (int i = 0; i < sectors; ++i) {
            const int corner = j * (sectors + 1) + i, above = corner + sectors + 1;
            mesh.triangles.emplace_back(corner, corner + 1, above + 1);
            mesh.triangles.emplace_back(corner, above + 1, above);
        }
    }
    return mesh;
}

void add_quadric(Reading& reading, const std::string& kind, Params& params) {
    Quadric quadric = read_quadric(kind, params);
    const std::optional<SurfaceTraits> traits = traits_here(reading, params);
    if (!traits) return;
    quadric.world_from_object = reading.state.ctm;
    quadric.traits = *traits;
    const bool flattened = !inverse(reading.state.ctm);
    if (!flattened && (!reading.state.area_light || !emits(reading, params))) {
        reading.shapes().quadrics.push_back(quadric);
    } else if (!flattened && emits_exactly(quadric)) {
        std::vector<Quadric>& quadrics = reading.shapes().quadrics;
        quadric.traits.light =
            attach_light(reading, quadric.traits, AreaSpec::Surface::quadric, quadrics.size());
        quadrics.push_back(quadric);
    } else {
        add_mesh(reading, params, *traits, tessellated(quadric));
    }
}

}  // namespace lucerna
