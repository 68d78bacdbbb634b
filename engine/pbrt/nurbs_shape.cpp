// Converts nurbs, rational B-spline surfaces, to triangles.
//
// Points, tangents and normals are evaluated on a grid whose lines include every knot, so that creases at
// multiple knots stay sharp (The NURBS Book, Piegl and Tiller, algorithms A2.1 to A2.3 and 4.4).
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/pbrt/shapes.h"

namespace lucerna {
namespace {

using Type = Param::Type;

constexpr int kMostOrder = 16;
constexpr std::size_t kMostPoints = 1U << 24;  // of the grid

// One direction with `count` control points, degree order - 1 and count + order knots.
struct Axis {
    int count = 0, order = 0;
    std::vector<double> knots;
    double first = 0, last = 0;  // range that is evaluated
};

struct Basis {
    int span = 0;  // knots[span] <= t < knots[span + 1]
    // Values of the basis functions of the control points span - order + 1 to span.
    std::array<double, kMostOrder> value{}, slope{};
};

// Evaluates all basis functions of degree `degree` that are not 0 at t, by Cox and de Boor's recurrence.
std::array<double, kMostOrder> basis_values(const Axis& axis, int span, int degree, double t) {
    std::array<double, kMostOrder> n{};
    std::array<double, kMostOrder> left{}, right{};
    n[0] = 1;
    for (int j = 1; j <= degree; ++j) {
        left[j] = t - axis.knots[span + 1 - j];
        right[j] = axis.knots[span + j] - t;
        double saved = 0;
        for (int r = 0; r < j; ++r) {
            const double width = right[r + 1] + left[j - r];
            const double share = width > 0 ? n[r] / width : 0;
            n[r] = saved + right[r + 1] * share;
            saved = left[j - r] * share;
        }
        n[j] = saved;
    }
    return n;
}

Basis basis_at(const Axis& axis, int span, double t) {
    Basis basis;
    basis.span = span;
    const int degree = axis.order - 1;
    basis.value = basis_values(axis, span, degree, t);
    if (degree == 0) return basis;
    // The derivative of a basis function is the difference of two of one degree less.
    const auto lower = basis_values(axis, span, degree - 1, t);
    for (int r = 0; r <= degree; ++r) {
        const int i = span - degree + r;
        const double before = axis.knots[i + degree] - axis.knots[i];
        const double after = axis.knots[i + degree + 1] - axis.knots[i + 1];
        double slope = 0;
        if (r > 0 && before > 0) slope += lower[r - 1] / before;
        if (r < degree && after > 0) slope -= lower[r] / after;
        basis.slope[r] = degree * slope;
    }
    return basis;
}

// A line of the grid. Each knot span of nonzero width has lines, including both ends.
struct Line {
    double t;
    int span;
};
std::vector<Line> lines_of(const Axis& axis, int pieces) {
    std::vector<Line> lines;
    for (int span = axis.order - 1; span < axis.count; ++span) {
        const double begin = std::max(axis.knots[span], axis.first),
                     end = std::min(axis.knots[span + 1], axis.last);
        if (!(end > begin)) continue;
        for (int i = 0; i <= pieces; ++i) {
            // The last line of a span is the first of the next one.
            if (i == 0 && !lines.empty()) continue;
            lines.push_back(
                {i == pieces ? end : std::lerp(begin, end, static_cast<double>(i) / pieces), span});
        }
    }
    return lines;
}

Axis read_axis(Params& params, char name) {
    Axis axis;
    axis.count = params.integer(fmt::format("n{}", name), -1);
    axis.order = params.integer(fmt::format("{}order", name), -1);
    if (axis.order < 2 || axis.order > kMostOrder || axis.count < axis.order) {
        fail(params.place(),
             "{}: {} control points of order {} along {}; expected an order of 2 to {}, and at least as many "
             "points",
             params.owner(), axis.count, axis.order, name, kMostOrder);
    }
    const std::string knots_name = fmt::format("{}knots", name);
    const Param* knots = params.find(knots_name, {Type::real});
    const std::size_t want = static_cast<std::size_t>(axis.count) + static_cast<std::size_t>(axis.order);
    if (!knots || knots->numbers.size() != want) {
        fail(params.place_of(knots_name), "{}: expected {}, the number of points plus the order along {}",
             knots_name, want, name);
    }
    axis.knots = knots->numbers;
    if (!std::is_sorted(axis.knots.begin(), axis.knots.end()))
        fail(knots->place, "\"{}\" decrease; expected ascending knots", knots_name);
    const double begin = axis.knots[axis.order - 1], end = axis.knots[axis.count];
    axis.first = std::max(begin, params.real(fmt::format("{}0", name), begin));
    axis.last = std::min(end, params.real(fmt::format("{}1", name), end));
    if (!(axis.first < axis.last)) fail(params.place(), "{} has no extent along {}", params.owner(), name);
    return axis;
}

// x, y, z times the weight, and the weight.
struct Homogeneous {
    V3d p{0.0};
    double w = 0;
    void add(const Homogeneous& other, double share) {
        p += share * other.p;
        w += share * other.w;
    }
};

std::vector<Homogeneous> read_control_points(Params& params, std::size_t want) {
    std::vector<Homogeneous> points;
    if (const Param* weighted = params.find("Pw", {Type::real})) {
        const std::vector<double>& n = weighted->numbers;
        for (std::size_t i = 0; i + 3 < n.size(); i += 4)
            points.push_back({V3d(n[i], n[i + 1], n[i + 2]), n[i + 3]});
    } else if (const Param* plain = params.find("P", {Type::point3})) {
        for (const V3d& p : triples(*plain)) points.push_back({p, 1});
    }
    if (points.size() != want) {
        fail(params.place(), "{} has {} control points; expected nu·nv = {}, as \"point P\" or \"float Pw\"",
             params.owner(), points.size(), want);
    }
    for (const Homogeneous& point : points) {
        if (!(point.w > 0)) fail(params.place_of("Pw"), "\"Pw\": weight {:g}; expected more than 0", point.w);
    }
    return points;
}

struct NurbsPoint {
    V3d p, n;  // n is not normalised, and is 0 where tangents vanish
};

NurbsPoint evaluate(const std::vector<Homogeneous>& points, int nu, const Basis& u, int u_order,
                    const Basis& v, int v_order) {
    Homogeneous at, along_u, along_v;
    for (int j = 0; j < v_order; ++j) {
        for (int i = 0; i < u_order; ++i) {
            const Homogeneous& point =
                points[static_cast<std::size_t>(u.span - u_order + 1 + i) +
                       static_cast<std::size_t>(v.span - v_order + 1 + j) * static_cast<std::size_t>(nu)];
            at.add(point, u.value[i] * v.value[j]);
            along_u.add(point, u.slope[i] * v.value[j]);
            along_v.add(point, u.value[i] * v.slope[j]);
        }
    }
    // Applies the quotient rule; positive weights keep at.w positive.
    const V3d p = at.p / at.w;
    const V3d dpdu = (along_u.p - along_u.w * p) / at.w, dpdv = (along_v.p - along_v.w * p) / at.w;
    return {p, dpdu.cross(dpdv)};
}

void add_triangles(ObjectMesh& mesh, int columns, int rows) {
    for (int y = 0; y + 1 < rows; ++y) {
        for (int x = 0; x + 1 < columns; ++x) {
            const int corner = x + y * columns, above = corner + columns;
            mesh.triangles.emplace_back(corner, corner + 1, above + 1);
            mesh.triangles.emplace_back(corner, above + 1, above);
        }
    }
}

// Computes normals at poles, where a tangent vanishes, from the adjacent triangles.
void mend_normals(ObjectMesh& mesh) {
    std::vector<V3d> sums(mesh.p.size(), V3d(0));
    for (const V3i& t : mesh.triangles) {
        const V3d cross = (mesh.p[t.y] - mesh.p[t.x]).cross(mesh.p[t.z] - mesh.p[t.x]);
        for (const int vertex : {t.x, t.y, t.z}) sums[vertex] += cross;
    }
    for (std::size_t i = 0; i < mesh.n.size(); ++i) {
        if (!(mesh.n[i].length() > 1e-9 * std::sqrt(sums[i].length2()))) mesh.n[i] = sums[i];
    }
}

}  // namespace

ObjectMesh read_nurbs(Params& params) {
    const Axis u = read_axis(params, 'u'), v = read_axis(params, 'v');
    const auto points =
        read_control_points(params, static_cast<std::size_t>(u.count) * static_cast<std::size_t>(v.count));
    // Spans of degree 1 are also divided, because they are straight along their own lines but not across
    // them.
    constexpr int kPieces = 16;
    const std::vector<Line> us = lines_of(u, kPieces), vs = lines_of(v, kPieces);
    if (us.size() * vs.size() > kMostPoints)
        fail(params.place(), "{} has more than {} points; use fewer", params.owner(), kMostPoints);
    std::vector<Basis> u_basis;
    u_basis.reserve(us.size());
    for (const Line& line : us) u_basis.push_back(basis_at(u, line.span, line.t));
    ObjectMesh mesh;
    for (const Line& line : vs) {
        const Basis v_basis = basis_at(v, line.span, line.t);
        for (std::size_t i = 0; i < us.size(); ++i) {
            const NurbsPoint at = evaluate(points, u.count, u_basis[i], u.order, v_basis, v.order);
            mesh.p.push_back(at.p);
            mesh.n.push_back(at.n);
            mesh.uv.emplace_back(static_cast<float>((us[i].t - u.first) / (u.last - u.first)),
                                 static_cast<float>((line.t - v.first) / (v.last - v.first)));
        }
    }
    add_triangles(mesh, static_cast<int>(us.size()), static_cast<int>(vs.size()));
    mend_normals(mesh);
    return mesh;
}

}  // namespace lucerna
