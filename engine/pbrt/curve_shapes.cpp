// Converts curves of any basis and degree to cubic Bézier segments.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/base/elementary.h"
#include "engine/base/vec.h"
#include "engine/pbrt/shapes.h"
#include "engine/system/memory.h"

namespace lucerna {
namespace {

using Type = Param::Type;
using Segment = std::array<V3d, 4>;

// Raises a quadratic Bézier segment to a cubic one.
Segment raised(const V3d& a, const V3d& b, const V3d& c) {
    return {a, a + 2.0 / 3 * (b - a), c + 2.0 / 3 * (b - c), c};
}

// Converts the uniform B-spline's segment over p[0] to p[degree] to Bézier form (blossoming).
Segment of_bspline(const V3d* p, int degree) {
    if (degree == 2) return raised(0.5 * (p[0] + p[1]), p[1], 0.5 * (p[1] + p[2]));
    const V3d b1 = (2.0 * p[1] + p[2]) / 3, b2 = (p[1] + 2.0 * p[2]) / 3;
    const V3d before = (p[0] + 2.0 * p[1]) / 3, after = (2.0 * p[2] + p[3]) / 3;
    return {0.5 * (before + b1), b1, b2, 0.5 * (b2 + after)};
}

std::vector<Segment> read_segments(Params& params) {
    const std::string basis = params.string("basis", "bezier");
    const int degree = params.integer("degree", 3);
    if (basis != "bezier" && basis != "bspline") {
        fail(params.place_of("basis"), "basis \"{}\" is unknown; expected bezier or bspline", shown(basis));
    }
    if (degree != 2 && degree != 3) {
        fail(params.place_of("degree"), "degree {} is not accepted; expected 2 or 3", degree);
    }
    const Param* param = params.find("P", {Type::point3});
    if (!param) fail(params.place(), "{} lacks \"point3 P\", its control points", params.owner());
    const std::vector<V3d> p = triples(*param);
    const auto step = static_cast<std::size_t>(degree);
    std::vector<Segment> segments;
    if (basis == "bezier") {
        if (p.size() < step + 1 || (p.size() - 1) % step != 0) {
            fail(param->place, "\"P\" has {} control points; expected {} plus a multiple of {}", p.size(),
                 step + 1, step);
        }
        for (std::size_t i = 0; i + step < p.size(); i += step) {
            segments.push_back(degree == 3 ? Segment{p[i], p[i + 1], p[i + 2], p[i + 3]}
                                           : raised(p[i], p[i + 1], p[i + 2]));
        }
    } else {
        if (p.size() < step + 1) {
            fail(param->place, "\"P\" has {} control points; expected at least {}", p.size(), step + 1);
        }
        for (std::size_t i = 0; i + step < p.size(); ++i) segments.push_back(of_bspline(&p[i], degree));
    }
    return segments;
}

Curves::Kind read_kind(Params& params) {
    const std::string name = params.string("type", "flat");
    if (name == "flat") return Curves::Kind::flat;
    if (name == "cylinder") return Curves::Kind::round;
    if (name == "ribbon") return Curves::Kind::ribbon;
    fail(params.place_of("type"), "type \"{}\" is unknown; expected flat, cylinder or ribbon", shown(name));
}

// Reads normals at the ends of the segments. They are interpolated on the great circle, as in pbrt.
std::vector<V3d> read_normals(Params& params, std::size_t segments) {
    const Param* param = params.find("N", {Type::normal3});
    if (!param) fail(params.place(), "{} of type ribbon lacks \"normal3 N\"", params.owner());
    std::vector<V3d> n = triples(*param);
    if (n.size() != segments + 1) {
        fail(param->place, "\"N\" has {} normals for {} segments; expected {}", n.size(), segments,
             segments + 1);
    }
    for (std::size_t i = 0; i < n.size(); ++i) {
        n[i].normalize();
        if (!(n[i].length2() > 0)) fail(param->place_of(3 * i), "\"N\": normal {} has no direction", i);
    }
    return n;
}

V3d on_great_circle(const V3d& a, const V3d& b, double t) {
    const double angle = acos(std::clamp(a.dot(b), -1.0, 1.0));
    const double sine = sin(angle);
    if (sine < 1e-6) return a;  // equal or opposite normals determine no great circle
    return (sin((1 - t) * angle) * a + sin(t * angle) * b) / sine;
}

// A curve that emits becomes a tube with 16 sides and 16 pieces per segment.
constexpr int kSides = 16, kPieces = 16;
constexpr std::uint64_t kBytesOfTube =
    kPieces * ((kSides + 1) * (sizeof(V3d) + sizeof(V2f)) + 2 * kSides * sizeof(V3i));
ObjectMesh tube(const std::vector<Segment>& segments, const std::vector<double>& radii) {
    const auto rings = static_cast<int>(segments.size()) * kPieces + 1;
    ObjectMesh mesh;
    V3f side(0.0F);
    for (int i = 0; i < rings; ++i) {
        const auto s = static_cast<std::size_t>(std::min(i / kPieces, static_cast<int>(segments.size()) - 1));
        const double u = static_cast<double>(i) / kPieces - static_cast<double>(s), w = 1 - u;
        const Segment& b = segments[s];
        const V3d p = w * w * w * b[0] + 3 * u * w * w * b[1] + 3 * u * u * w * b[2] + u * u * u * b[3];
        V3d d = w * w * (b[1] - b[0]) + 2 * u * w * (b[2] - b[1]) + u * u * (b[3] - b[2]);
        if (!(d.length2() > 0)) d = b[3] - b[0];
        // The first point of each ring turns as little as possible from ring to ring.
        const V3f along(d.length2() > 0 ? d.normalized() : V3d(0, 0, 1));
        V3f x = side - side.dot(along) * along;
        if (!(x.length() > 1e-3F)) x = Frame(along).s;
        side = x.normalized();
        const V3f y = along.cross(side);
        const double r = radii[4 * s] * w + radii[4 * s + 3] * u;
        for (int k = 0; k <= kSides; ++k) {
            const double phi = 2 * M_PI * k / kSides;
            mesh.p.push_back(p + r * (cos(phi) * V3d(side) + sin(phi) * V3d(y)));
            mesh.uv.emplace_back(static_cast<float>(i) / static_cast<float>(rings - 1),
                                 static_cast<float>(k) / kSides);
        }
    }
    for (int i = 0; i + 1 < rings; ++i) {
        for (int k = 0; k < kSides; ++k) {
            const int corner = i * (kSides + 1) + k, next = corner + kSides + 1;
            mesh.triangles.emplace_back(corner, corner + 1, next + 1);
            mesh.triangles.emplace_back(corner, next + 1, next);
        }
    }
    return mesh;
}

// Returns the scale of widths, the cube root of the change of volume. It is exact only for a similarity.
double width_scale(const M44d& m) {
    return cbrt(std::fabs(m.determinant()));
}

}  // namespace

void add_curve(Reading& reading, Params& params) {
    const std::vector<Segment> segments = read_segments(params);
    DraftCurves curves;
    curves.kind = read_kind(params);
    const double width = params.real_within("width", 1, 0, 1e30);
    const double from = params.real_within("width0", width, 0, 1e30);
    const double to = params.real_within("width1", width, 0, 1e30);
    params.accept({"splitdepth"});
    std::vector<V3d> normals;
    if (curves.kind == Curves::Kind::ribbon) {
        normals = read_normals(params, segments.size());
    } else if (params.find("N", {Type::normal3})) {
        reading.warn(params.place_of("N"), "\"N\" has no effect; only curves of type ribbon have normals");
    }
    const auto count = static_cast<double>(segments.size());
    std::vector<double> radii;  // at each control point; the width is linear along the whole curve
    for (std::size_t i = 0; i < segments.size(); ++i) {
        for (int k = 0; k < 4; ++k) {
            radii.push_back(0.5 * std::lerp(from, to, (static_cast<double>(i) + k / 3.0) / count));
        }
    }
    const std::optional<SurfaceTraits> traits = traits_here(reading, params);
    if (!traits) return;
    const std::optional<M44d> back = inverse(reading.state.ctm);
    if (!back || (reading.state.area_light && emits(reading, params))) {
        require_memory(bytes_of(segments.size(), kBytesOfTube),
                       fmt::format("{}: the triangles of {} segments", to_string(params.place().location()),
                                   segments.size()),
                       "use fewer segments");
        return add_mesh(reading, params, *traits, tube(segments, radii));
    }
    curves.traits = *traits;
    const double scale = width_scale(reading.state.ctm);
    for (std::size_t i = 0; i < segments.size(); ++i) {
        for (std::size_t k = 0; k < 4; ++k) {
            curves.p.push_back(transformed_point(reading, params, segments[i][k], 4 * i + k));
            curves.radius.push_back(static_cast<float>(radii[4 * i + k] * scale));
            if (normals.empty()) continue;
            const V3d n = on_great_circle(normals[i], normals[i + 1], static_cast<double>(k) / 3);
            curves.n.emplace_back(V3f(transform_normal(*back, n).normalized()));
        }
        curves.segments.push_back({static_cast<float>(static_cast<double>(i) / count),
                                   static_cast<float>((static_cast<double>(i) + 1) / count)});
    }
    reading.shapes().curves.push_back(std::move(curves));
}

}  // namespace lucerna
