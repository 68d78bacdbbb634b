#include "lights/measured.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>

#include "engine/base/elementary.h"
#include "engine/base/error.h"
#include "lights/cell_emission.h"
#include "lights/emission_net.h"
#include "lights/field_pyramid.h"

namespace lucerna {
namespace {

constexpr std::uint64_t kMostCells = 4'000'000'000U;  // CellId reserves its largest values

// A line of a slab's field: its point of S, and the vector from there to another point on it, which lies
// behind S if way.z < 0. The frame is the slab's, with its origin at the centre of S.
struct Line {
    V2d on_s;
    V3d way;
    int n = 0, o = 0;  // interval of S
};

// Radiance along a line in the scene is scale times colour; the scene's lengths change `scale`, not the flux.
struct Radiance {
    double scale = 0;
    Rgb colour{0};
    bool any() const { return scale > 0 && luminance(colour) > 0; }
    double light() const { return any() ? scale * double{luminance(colour)} : 0.0; }
};

// Parts are blocks of intervals, at most this many across S; a few dozen photons could not resolve finer
// ones.
constexpr int kPartsAcross = 16;

// One slab of the lamp, placed in the scene. It must not move, because its members refer to each other.
class PlacedSlab {
  public:
    struct Flux {
        double lamp;   // total flux of the lamp [field's unit]
        double share;  // the slab's share of it; 0: a dark slab
    };

    // `first` is the number of its first cell among those of all slabs.
    PlacedSlab(LightField field, CellTable table, const M44d& world_from_slab,
               const MeasuredSettings& settings, const Flux& flux, CellId first, const Workers& workers)
        : field_(std::move(field)),
          colour_(field_, workers, settings.colours),
          table_(std::move(table)),
          placement_(world_from_slab, field_.rig().centre, {settings.file.string()}),
          share_(flux.share),
          gain_(flux.share > 0 ? flux.lamp * flux.share / table_.flux()
                               : 0.0),  // a slab with a share of the flux has a table with flux
          extent_(static_cast<float>(
              std::sqrt(placement_.scale2()) * 2 *
              std::max(-field_.rig().interval_edge(0, 0), -field_.rig().interval_edge(1, 0)))),
          first_(first),
          reconstruction_(settings.reconstruction),
          // Each particle has the lamp's flux, whatever slab was chosen for it.
          emission_(field_, colour_, table_, placement_, {settings.mode, flux.lamp, extent_}) {
        if (flux.share > 0) pyramid_.emplace(field_, table_, kPartsAcross, workers);
    }
    PlacedSlab(const PlacedSlab&) = delete;
    PlacedSlab& operator=(const PlacedSlab&) = delete;

    bool dark() const { return !pyramid_; }
    double share() const { return share_; }
    const LightField& field() const { return field_; }
    const FieldColour& colour() const { return colour_; }
    const Placement& placement() const { return placement_; }
    // Draws particles at the points where their lines pass S.
    void emit(std::span<const LeSampleU> u, std::span<std::optional<LeSample>> out) const {
        emission_.sample_Le_many(u, out);
        if (reconstruction_ != Reconstruction::exact) reconstruct(out);
    }
    const FieldPyramid& pyramid() const { return *pyramid_; }
    float extent() const { return extent_; }

    bool holds(CellId id) const { return id >= first_ && id - first_ < table_.cells(); }
    std::optional<Cell> cell(CellId id) const { return holds(id) ? table_.cell(id - first_) : std::nullopt; }
    CellId first() const { return first_; }

    // Returns the direction of the line's light in the scene.
    V3d direction_of(const Line& line) const {
        const V3d d = placement_.vector(line.way).normalized();
        return line.way.z > 0 ? d : -d;
    }

    // Returns the line through `from` whose light travels along -against, or none if it misses S.
    std::optional<Line> line_of(const V3d& from, const V3d& against) const {
        const Rig& rig = field_.rig();
        const V3d o = placement_.to_local_point(from);
        const V3d d = placement_.to_local_vector(against);
        if (!(d.z < 0)) return std::nullopt;
        const double t = -o.z / d.z;  // d has the scale of o, so t is in scene units
        Line line{{o.x + t * d.x, o.y + t * d.y}, -t * d, 0, 0};
        for (int a = 0; a < 2; ++a) {
            const double x = rig.intervals_to(a, line.on_s[a]);
            if (!(x >= 0 && x < rig.intervals(a))) return std::nullopt;
            (a == 0 ? line.n : line.o) = static_cast<int>(x);
        }
        return line;
    }

    Radiance radiance_along(const Line& line) const {
        if (line.way.z == 0) return {};  // x lies on S
        const V2d at_m = on_m(line);
        if (!field_.coloured()) {
            const double radiance = double{reconstruction_ == Reconstruction::approximate
                                               ? field_.approximate_radiance(line.on_s, at_m)
                                               : field_.radiance(line.on_s, at_m)};
            return {gain_ * radiance / placement_.scale2(), colour_.mean()};
        }
        Rgb h(0);
        field_.for_each_pixel(line.on_s, at_m, [&](const Cell& cell, float x, float y, float weight) {
            const float w = field_.members(cell).value(x, y);
            if (!(w > 0)) return;
            const LightField::ColourCell colour = field_.colour_members(cell);
            h += weight * w * colour_.of(w, colour.x.value(x, y), colour.z.value(x, y));
        });
        if (!(luminance(h) > 0)) return {};  // also where g itself is 0: rays that pass M at infinity
        const double approximation = double{field_.over_exact(reconstruction_, line.on_s, at_m)};
        return {approximation * gain_ / (field_.rig().geometric_term(line.on_s, at_m) * placement_.scale2()),
                h};
    }

    // Returns the density on S with which the place at the end of the way draws this line.
    FieldPyramid::Density density(const Line& line) const {
        const V3d x(line.on_s.x + line.way.x, line.on_s.y + line.way.y, line.way.z);
        return pyramid_->density(x, line.on_s);
    }
    // Returns densities per solid angle at the way's end [slab's frame]: pdf_a R² / cosθ; scale² cancels.
    PartPdf per_solid_angle(const Line& line, const FieldPyramid::Density& density) const {
        const double r2 = line.way.length2();
        // There is radiance, so the way has a length and way.z is not 0.
        const double per_area = r2 * std::sqrt(r2) / std::fabs(line.way.z);
        return {name_of(line.n, line.o), static_cast<float>(density.whole * per_area),
                static_cast<float>(density.part * per_area)};
    }

    // Returns the irradiance at x, in front of S or behind it, over the slab's flux.
    double arriving(const V3f& x) const {
        const V3d at = placement_.to_local_point(V3d(x));
        return at.z == 0 ? 0.0 : pyramid_->arriving(at) / placement_.scale2();
    }

    // Names a part by its first cell or, in a lamp of several slabs, by a cell along the normal.
    CellId name_of(int n, int o) const {
        const V2i part = pyramid_->part_of(n, o);
        return first_ + table_.id({part.x, part.y, named_column_[0], named_column_[1]});
    }
    void name_by_middle_columns() {
        for (int axis = 0; axis < 2; ++axis) named_column_[axis] = field_.rig().columns(axis) / 2;
    }

    CellId cell_at(const Line& line) const {
        const Rig& rig = field_.rig();
        const V2d m = on_m(line);
        // Light beyond the edges of the outermost columns belongs to these columns.
        const auto column = [&](int axis, int interval) {
            const double x = rig.columns_to(axis, interval, m[axis]);
            return static_cast<int>(std::clamp(x, 0.0, rig.columns(axis) - 1.0));
        };
        return first_ + table_.id({line.n, line.o, column(0, line.n), column(1, line.o)});
    }
    // Returns the line through the centre of a cell, in the scene: a point of S and the direction.
    std::pair<V3d, V3d> middle_of(const Cell& cell) const {
        const Rig& rig = field_.rig();
        const auto s = [&](int axis, int n) {
            return rig.s_coordinate.on_plane(rig.interval_edge_x(axis, n) + 0.5 * rig.spacing[axis]);
        };
        const auto m = [&](int axis, int n, int p) {
            return rig.m_coordinate.on_plane(rig.column_edge_x(axis, n, p) + 0.5 * rig.pixel[axis]);
        };
        const V2d on_s(s(0, cell.n), s(1, cell.o)), at_m(m(0, cell.n, cell.p), m(1, cell.o, cell.q));
        return {placement_.point(on_s),
                placement_.vector({at_m.x - on_s.x, at_m.y - on_s.y, rig.distance}).normalized()};
    }

    // Returns a bound around S with the largest angle between a line and the normal.
    LightBounds bounds() const {
        const Rig& rig = field_.rig();
        LightBounds bounds;
        double across2 = 0;
        for (int a = 0; a < 2; ++a) {
            const double s = rig.interval_edge(a, rig.intervals(a));
            const double m = std::max(std::fabs(rig.m_edge(a, 0, false)),
                                      std::fabs(rig.m_edge(a, rig.intervals(a) - 1, true)));
            across2 += sqr(s + m);
        }
        for (int corner = 0; corner < 4; ++corner) {
            const V2d p(rig.interval_edge(0, corner % 2 == 0 ? 0 : rig.intervals(0)),
                        rig.interval_edge(1, corner < 2 ? 0 : rig.intervals(1)));
            bounds.box.extendBy(to_float(placement_.point(p)));
        }
        bounds.axis = to_float(placement_.normal());
        bounds.theta_o = static_cast<float>(atan2(std::sqrt(across2), rig.distance));
        bounds.theta_e = 0;
        return bounds;
    }

  private:
    // Converts particles of the exact reconstruction to those of the approximate one.
    void reconstruct(std::span<std::optional<LeSample>> particles) const {
        for (auto& particle : particles) {
            if (!particle) continue;
            const V3d p = placement_.to_local_point(V3d(particle->from.p));
            const V3d d = placement_.to_local_vector(V3d(particle->d));
            if (!(d.z > 0)) continue;  // by rounding, a line along S
            const Line line{{p.x, p.y}, d, 0, 0};
            particle->weight *= field_.over_exact(reconstruction_, line.on_s, on_m(line));
        }
    }

    // Returns where the line passes M, unboundedly far for grazing lines. Requires way.z != 0.
    V2d on_m(const Line& line) const {
        const double stretch = field_.rig().distance / line.way.z;
        return {line.on_s.x + line.way.x * stretch, line.on_s.y + line.way.y * stretch};
    }

    LightField field_;
    FieldColour colour_;
    CellTable table_;
    Placement placement_;
    double share_;
    double gain_;   // flux over the clamped field's flux
    float extent_;  // larger side of S [scene units]
    CellId first_;
    Reconstruction reconstruction_;
    int named_column_[2] = {0, 0};
    std::optional<FieldPyramid> pyramid_;  // empty for a dark slab
    CellEmission emission_;
};

// The box of a lamp of several slabs, in the scene, on which the light of its lines begins.
class LampBox {
  public:
    LampBox(const Box3d& box, const M44d& world_from_light, const Location& at)
        : placement_(world_from_light, box.center(), at), half_(0.5 * box.size()) {
        extent_ = static_cast<float>(2 * half_.length() * std::sqrt(placement_.scale2()));
    }

    // Returns where the line through p along d (unit) leaves the box, or else passes nearest to its centre.
    SurfacePoint begin(const V3d& p, const V3d& d) const {
        const V3d o = placement_.to_local_point(p), along = placement_.to_local_vector(d);
        double enter = -INFINITY, leave = INFINITY;
        int face = 0;
        for (int a = 0; a < 3; ++a) {
            if (along[a] == 0) {
                if (std::fabs(o[a]) > half_[a]) leave = -INFINITY;
                continue;
            }
            const double near = std::copysign(half_[a], along[a]);
            enter = std::max(enter, (-near - o[a]) / along[a]);
            const double out = (near - o[a]) / along[a];
            if (out < leave) leave = out, face = a;
        }
        const bool crosses = leave >= enter && std::isfinite(leave);
        const double t = crosses ? leave : -o.dot(along) / along.length2();
        SurfacePoint from;
        from.p = to_float(p + t * d);
        V3d normal(0, 0, 0);
        normal[face] = along[face];
        from.n = to_float(crosses ? placement_.vector(normal).normalized() : d);
        from.error = surface_error(from.p, extent_);
        return from;
    }
    float extent() const { return extent_; }
    // Converts to the box's frame, in metres from its centre.
    V3d from_middle(const V3d& p) const { return placement_.to_local_point(p); }
    V3d to_lamp(const V3d& d) const { return placement_.to_local_vector(d); }
    const V3d& half() const { return half_; }

  private:
    Placement placement_;
    V3d half_;
    float extent_ = 0;
};

class MeasuredLight final : public Light {
  public:
    // `shares` are the slabs' shares of the flux.
    MeasuredLight(Lumigraph lamp, std::vector<CellTable> tables, const MeasuredSettings& settings,
                  double flux, const std::vector<double>& shares, std::unique_ptr<const LampShape> shape,
                  const Workers& workers)
        : Light(settings.unit.taken(lamp.unit())), flux_(flux), shape_(std::move(shape)) {
        const Location at{settings.file.string()};
        if (!lamp.simple()) box_.emplace(lamp.box(), settings.world_from_light, at);
        CellId first = 0;
        double upto = 0;
        Rgb mean(0);
        for (std::size_t i = 0; i < tables.size(); ++i) {
            Slab& slab = lamp.slabs()[i];
            const auto cells = static_cast<CellId>(tables[i].cells());
            const M44d world_from_slab = slab.axes.straight()
                                             ? settings.world_from_light
                                             : matrix_of(slab.axes) * settings.world_from_light;
            slabs_.push_back(
                std::make_unique<PlacedSlab>(std::move(slab.field), std::move(tables[i]), world_from_slab,
                                             settings, PlacedSlab::Flux{flux_, shares[i]}, first, workers));
            if (tables.size() > 1) slabs_.back()->name_by_middle_columns();
            normals_.push_back(slab.axes.n);
            first += cells;
            upto += shares[i];
            upto_.push_back(static_cast<float>(upto));
            mean += static_cast<float>(shares[i]) * slabs_.back()->colour().mean();
        }
        colour_ = tables.size() == 1 ? slabs_[0]->colour().mean() : mean;
        // The last slab with flux takes what rounding leaves.
        for (std::size_t i = slabs_.size(); i-- > 0 && !(upto_[i] < static_cast<float>(upto));) upto_[i] = 1;
    }

    std::string_view kind() const override { return "lightfield"; }
    Rgb flux() const override { return static_cast<float>(flux_) * colour_; }
    bool has_impostor() const override { return true; }

    std::optional<LeSample> sample_Le(const LeSampleU& u) const override {
        std::optional<LeSample> one;
        sample_Le_many({&u, 1}, {&one, 1});
        return one;
    }
    void sample_Le_many(std::span<const LeSampleU> u, std::span<std::optional<LeSample>> out) const override {
        if (!(flux_ > 0)) {
            std::fill(out.begin(), out.end(), std::nullopt);
            return;
        }
        emit(u, out);
        move_to_shape(out);
    }

    // Estimates the share of the flux along lines that miss the shape.
    double beside_shape() const {
        constexpr std::size_t kLines = 4096;
        if (!shape_ || !(flux_ > 0)) return 0;
        std::vector<LeSampleU> u;
        const EmissionNet net(0, Purpose::emission, 0);
        for (std::uint32_t i = 0; i < kLines; ++i) u.push_back(net.at(i).u);
        std::vector<std::optional<LeSample>> out(kLines);
        emit(u, out);
        double missed = 0, all = 0;
        for (const auto& e : out) {
            if (!e) continue;
            const auto weight = static_cast<double>(luminance(e->weight));
            all += weight;
            if (!shape_->last_crossing(V3d(e->from.p), V3d(e->d))) missed += weight;
        }
        return all > 0 ? missed / all : 0;
    }

    std::optional<LightSample> sample_Li(const V3f& x, const V2f& u,
                                         std::optional<CellId> from) const override {
        if (!(flux_ > 0)) return std::nullopt;
        std::size_t chosen = 0;
        std::optional<V2i> within;
        V2f rest = u;
        if (from) {
            const auto cell = cell_of(*from, chosen);
            if (!cell || slabs_[chosen]->dark()) return std::nullopt;
            within = V2i(cell->n, cell->o);
        }
        Shares shares;
        if (slabs_.size() > 1) {
            shares = shares_at(x);
            if (!from) chosen = choose(shares, rest.x);
        }
        const PlacedSlab& slab = *slabs_[chosen];
        const V3d local = slab.placement().to_local_point(V3d(x));
        if (!(local.z > 0 || shape_ || box_)) return std::nullopt;
        if (local.z == 0) return std::nullopt;
        const auto drawn = slab.pyramid().draw(local, rest, within);
        if (!drawn) return std::nullopt;
        const Line line{
            drawn->on_s, {local.x - drawn->on_s.x, local.y - drawn->on_s.y, local.z}, drawn->n, drawn->o};
        const V3d along = slab.direction_of(line);
        const Found found =
            slabs_.size() == 1
                ? Found{slab.radiance_along(line), slab.per_solid_angle(line, drawn->density), 0}
                : found_along(V3d(x), along, shares, {{chosen, line, drawn->density}});
        if (!found.radiance.any()) return std::nullopt;
        if (from && found.slab != chosen) return std::nullopt;  // light of another part
        const double distance = distance_to_origin(slab, line, x);
        if (!(distance > 0)) return std::nullopt;
        const float pdf_w = from ? found.part.part_pdf_w : found.part.whole_pdf_w;
        const auto weight = static_cast<float>(found.radiance.scale / double{pdf_w});
        if (!std::isfinite(weight)) return std::nullopt;  // the density underflowed in float32
        return LightSample{to_float(-along),
                           static_cast<float>(distance),
                           weight * found.radiance.colour,
                           pdf_w,
                           slab.cell_at(line),
                           found.part};
    }

    CellId part_of(CellId id) const override {
        std::size_t slab = 0;
        const std::optional<Cell> cell = cell_of(id, slab);
        if (!cell || !(flux_ > 0)) return kNoCell;
        if (slabs_.size() > 1) {
            // A direction leads to one part, whichever slab the particle came from.
            const auto [p, d] = slabs_[slab]->middle_of(*cell);
            if (const auto best = brightest_slab(p, d))
                return slabs_[best->slab]->name_of(best->line.n, best->line.o);
        }
        return slabs_[slab]->dark() ? kNoCell : slabs_[slab]->name_of(cell->n, cell->o);
    }

    // With a shape, light may begin anywhere along a line, so there are no bounds.
    std::optional<LightBounds> bounds() const override {
        if (shape_) return std::nullopt;
        if (!box_) return slabs_[0]->bounds();
        std::vector<LightBounds> all;
        for (const auto& slab : slabs_) {
            if (!slab->dark()) all.push_back(slab->bounds());
        }
        if (all.empty()) return std::nullopt;
        LightBounds bounds = union_of(all);
        // A place beside a slab's S is lit by lines that pass S beyond it.
        bounds.theta_o = kPi;
        return bounds;
    }

    std::optional<float> arriving(const V3f& x) const override {
        if (!(flux_ > 0)) return std::nullopt;
        double sum = 0;
        for (const auto& slab : slabs_)
            if (!slab->dark()) sum += slab->share() * slab->arriving(x);
        return static_cast<float>(sum);
    }

    // The impostor is S itself, or the lamp's box, where the ray's line does not cross the shape.
    std::optional<EmittedRadiance> Le(const Ray& ray) const override {
        if (!box_) return Le_on_plane(ray);
        if (!(flux_ > 0)) return std::nullopt;
        const V3d along = -V3d(ray.d).normalized();
        const SurfacePoint origin = box_->begin(V3d(ray.o), along);
        const double t = (V3d(ray.o) - V3d(origin.p)).dot(along);
        if (!(t > 0 && t <= double{ray.t_max})) return std::nullopt;
        const EmittedRadiance found = emitted_along(ray, static_cast<float>(t));
        if (!(luminance(found.radiance) > 0)) return std::nullopt;
        if (shape_ && shape_->last_crossing(V3d(ray.o), along)) return std::nullopt;
        return found;
    }

    // The shape emits where the light of the ray's line begins at this crossing and not further on.
    EmittedRadiance Le_on_surface(const Ray& ray, float t, const V3f& /*n*/,
                                  std::uint32_t /*primitive*/) const override {
        const EmittedRadiance dark{Rgb(0.0F), 0, t};
        if (!shape_ || !(flux_ > 0)) return dark;
        V3d on_line, along;
        EmittedRadiance found = dark;
        if (slabs_.size() == 1) {
            const auto line = slabs_[0]->line_of(V3d(ray.o), V3d(ray.d));
            if (!line) return dark;
            found = found_on(*line, t);
            on_line = slabs_[0]->placement().point(line->on_s), along = slabs_[0]->direction_of(*line);
        } else {
            found = emitted_along(ray, t);
            on_line = V3d(ray.o), along = -V3d(ray.d).normalized();
        }
        if (!(luminance(found.radiance) > 0)) return dark;
        const auto origin = shape_->last_crossing(on_line, along);
        if (!origin) return dark;
        const double beyond = (V3d(origin->p) - V3d(ray.o)).dot(-along) - double{t};
        return beyond > -kSameCrossing * double{shape_->extent()} ? found : dark;
    }

  private:
    // Two crossings of a line closer than this share of the shape's extent count as one.
    static constexpr double kSameCrossing = 1e-4;
    // The share of the choice of a slab that goes by flux alone.
    static constexpr double kDefensive = 0.1;

    // The probability of choosing each slab for a place.
    using Shares = std::array<double, Lumigraph::kMostSlabs>;

    // A line of one of the slabs, with its density there if known.
    struct SlabLine {
        std::size_t slab;
        Line line;
        std::optional<FieldPyramid::Density> density;
    };

    // The sum of all slabs along one line.
    struct Found {
        Radiance radiance;
        PartPdf part;
        std::size_t slab;  // the slab that holds the part
    };

    static M44d matrix_of(const SlabAxes& axes) {
        M44d m;
        for (int a = 0; a < 3; ++a) m[0][a] = axes.u[a], m[1][a] = axes.v[a], m[2][a] = axes.n[a];
        return m;
    }

    std::optional<Cell> cell_of(CellId id, std::size_t& slab) const {
        for (slab = 0; slab < slabs_.size(); ++slab) {
            if (slabs_[slab]->holds(id)) return slabs_[slab]->cell(id);
        }
        return std::nullopt;
    }

    // Far away, slab i contributes about the share (d·n_i)² (SlabShares). Near by, lines come from any place
    // of the box, so its half-width along n_i is added.
    Shares shares_at(const V3f& x) const {
        const V3d way = box_->from_middle(V3d(x));
        Shares shares{};
        double sum = 0;
        for (std::size_t i = 0; i < slabs_.size(); ++i) {
            if (slabs_[i]->dark()) continue;
            const V3d& n = normals_[i];
            const double reach = std::fabs(n.x) * box_->half().x + std::fabs(n.y) * box_->half().y +
                                 std::fabs(n.z) * box_->half().z;
            shares[i] = sqr(std::max(0.0, way.dot(n) + reach));
            sum += shares[i];
        }
        for (std::size_t i = 0; i < slabs_.size(); ++i) {
            const double flux = slabs_[i]->share();
            shares[i] = sum > 0 ? (1 - kDefensive) * shares[i] / sum + kDefensive * flux : flux;
        }
        return shares;
    }
    // Makes u uniform again.
    std::size_t choose(const Shares& shares, float& u) const {
        double before = 0;
        std::size_t last = 0;
        for (std::size_t i = 0; i < slabs_.size(); ++i) {
            if (!(shares[i] > 0)) continue;
            last = i;
            if (double{u} < before + shares[i]) break;
            before += shares[i];
        }
        u = std::min(static_cast<float>(std::max(0.0, (double{u} - before) / shares[last])), kBelowOne);
        return last;
    }

    // Returns the slab with most of the radiance along the line through p along d (unit), to whose part the
    // line leads. Another slab might hold the line without any light, and its parts would not find it.
    std::optional<SlabLine> brightest_slab(const V3d& p, const V3d& d) const {
        std::optional<SlabLine> best;
        double most = 0;
        for (std::size_t i = 0; i < slabs_.size(); ++i) {
            if (slabs_[i]->dark()) continue;
            const auto line = slabs_[i]->line_of(p, -d);
            if (!line || line->way.z == 0) continue;
            const double radiance = slabs_[i]->radiance_along(*line).light();
            if (radiance > most) best = {i, *line, {}}, most = radiance;
        }
        return best;
    }

    // Sums what a lamp of several slabs sends along `d` to x. A line of one slab may be known already.
    Found found_along(const V3d& x, const V3d& d, const Shares& shares,
                      const std::optional<SlabLine>& known = {}) const {
        Found found{{}, {kNoCell, 0, 0}, 0};
        Rgb sum(0);
        double whole = 0, most = 0;
        for (std::size_t i = 0; i < slabs_.size(); ++i) {
            const PlacedSlab& slab = *slabs_[i];
            if (slab.dark()) continue;
            const bool is_known = known && known->slab == i;
            const auto line = is_known ? std::optional(known->line) : slab.line_of(x, -d);
            if (!line || line->way.z == 0) continue;
            const Radiance radiance = slab.radiance_along(*line);
            if (radiance.any()) {
                sum += static_cast<float>(radiance.scale) * radiance.colour;
                found.radiance.scale = 1;
            }
            const PartPdf part =
                slab.per_solid_angle(*line, is_known ? *known->density : slab.density(*line));
            whole += shares[i] * double{part.whole_pdf_w};
            if (radiance.light() > most) most = radiance.light(), found.part = part, found.slab = i;
        }
        found.radiance.colour = sum;
        found.part.whole_pdf_w = static_cast<float>(whole);
        return found;
    }
    EmittedRadiance emitted_along(const Ray& ray, float t) const {
        const Found found = found_along(V3d(ray.o), -V3d(ray.d).normalized(), shares_at(ray.o));
        if (!found.radiance.any()) return {Rgb(0.0F), 0, t};
        return {found.radiance.colour, found.part.whole_pdf_w, t, found.part};
    }

    // For a lamp of one slab, returns what a ray along the line sees at distance t, with pdf_Li.
    EmittedRadiance found_on(const Line& line, float t) const {
        const Radiance radiance = slabs_[0]->radiance_along(line);
        if (!radiance.any()) return {Rgb(0.0F), 0, t};
        const PartPdf part = slabs_[0]->per_solid_angle(line, slabs_[0]->density(line));
        return {static_cast<float>(radiance.scale) * radiance.colour, part.whole_pdf_w, t, part};
    }
    std::optional<EmittedRadiance> Le_on_plane(const Ray& ray) const {
        if (!(flux_ > 0)) return std::nullopt;
        const PlacedSlab& slab = *slabs_[0];
        const auto line = slab.line_of(V3d(ray.o), V3d(ray.d));
        if (!line || !(line->way.z > 0)) return std::nullopt;
        const V3d way = slab.placement().vector(line->way);
        const double t = way.length();
        if (!(t <= double{ray.t_max})) return std::nullopt;
        const EmittedRadiance found = found_on(*line, static_cast<float>(t));
        if (!(luminance(found.radiance) > 0)) return std::nullopt;
        if (shape_ && shape_->last_crossing(slab.placement().point(line->on_s), slab.direction_of(*line)))
            return std::nullopt;
        return found;
    }

    // Returns the length of the shadow ray from x to where the line's light begins. It is not above 0 if x
    // lies behind that point.
    double distance_to_origin(const PlacedSlab& slab, const Line& line, const V3f& x) const {
        if (shape_) {
            const V3d along = slab.direction_of(line);
            const auto origin = shape_->last_crossing(slab.placement().point(line.on_s), along);
            if (origin) {
                // The ray ends `gap` in front of the shape; a grazing one (cosine 0) gives -inf.
                const double gap = double{origin->error} + double{surface_error(x, shape_->extent())};
                const double cosine = std::fabs(V3d(origin->n).dot(along));
                return (V3d(x) - V3d(origin->p)).dot(along) - gap / cosine;
            }
        }
        if (box_) {
            const V3d along = slab.direction_of(line);
            const double distance = (V3d(x) - V3d(box_->begin(V3d(x), along).p)).dot(along);
            if (!(distance > 0)) return 0;
            return std::max(0x1p-126, distance - double{surface_error(x, box_->extent())});
        }
        if (!(line.way.z > 0)) return 0;
        const double distance = line.way.length() * std::sqrt(slab.placement().scale2());
        return std::max(0x1p-126, distance - double{surface_error(x, slab.extent())});
    }

    // Draws particles at the points where their lines pass S.
    void emit(std::span<const LeSampleU> u, std::span<std::optional<LeSample>> out) const {
        if (slabs_.size() == 1) return slabs_[0]->emit(u, out);
        constexpr std::size_t kAtOnce = 4 * CellTable::Block::kSize;
        std::array<LeSampleU, kAtOnce> sorted;
        std::array<std::optional<LeSample>, kAtOnce> emitted;
        std::array<std::uint16_t, kAtOnce> slab_of, place;
        for (std::size_t begin = 0; begin < u.size(); begin += kAtOnce) {
            const std::size_t size = std::min(kAtOnce, u.size() - begin);
            for (std::size_t k = 0; k < size; ++k) slab_of[k] = slab_for(u[begin + k].position.x);
            for (std::size_t i = 0; i < slabs_.size(); ++i) {
                std::size_t count = 0;
                for (std::size_t k = 0; k < size; ++k) {
                    if (slab_of[k] != i) continue;
                    sorted[count] = u[begin + k];
                    const float before = i > 0 ? upto_[i - 1] : 0.0F;
                    sorted[count].position.x =
                        std::min((sorted[count].position.x - before) / (upto_[i] - before), kBelowOne);
                    place[count++] = static_cast<std::uint16_t>(k);
                }
                if (count == 0) continue;
                slabs_[i]->emit({sorted.data(), count}, {emitted.data(), count});
                for (std::size_t k = 0; k < count; ++k) {
                    if (emitted[k]) emitted[k]->cell += slabs_[i]->first();
                    out[begin + place[k]] = emitted[k];
                }
            }
        }
    }
    // Chooses in proportion to flux; dark slabs have width 0.
    std::uint16_t slab_for(float u) const {
        std::size_t i = 0;
        while (i + 1 < upto_.size() && !(u < upto_[i])) ++i;
        return static_cast<std::uint16_t>(i);
    }

    // Moves each particle to where its line last crosses the shape or leaves the box.
    void move_to_shape(std::span<std::optional<LeSample>> particles) const {
        if (!shape_ && !box_) return;
        for (auto& particle : particles) {
            if (!particle) continue;
            const V3d p(particle->from.p), d(particle->d);
            const auto origin = shape_ ? shape_->last_crossing(p, d) : std::nullopt;
            if (origin) {
                particle->from = *origin;
            } else if (box_) {
                particle->from = box_->begin(p, d.normalized());
            }
        }
    }

    double flux_;  // total flux [lamp's unit]
    Rgb colour_{1.0F};
    std::unique_ptr<const LampShape> shape_;  // may be null
    std::vector<std::unique_ptr<PlacedSlab>> slabs_;
    std::vector<V3d> normals_;    // lamp's frame
    std::vector<float> upto_;     // cumulative shares of the flux
    std::optional<LampBox> box_;  // empty for a single light field, whose lines begin on S
};

// Returns the slabs' shares of the flux, which add up to 1. They follow the measured flux where that is
// positive; a lamp without measured flux that is given a power uses the flux of its particles.
std::vector<double> shares_of(const Lumigraph& lamp, const std::vector<CellTable>& tables) {
    std::vector<double> shares(tables.size());
    for (const bool measured : {true, false}) {
        double sum = 0;
        for (std::size_t i = 0; i < tables.size(); ++i) {
            const double bright = std::max(0.0, tables[i].flux());
            shares[i] = !(bright > 0) ? 0.0 : measured ? std::max(0.0, lamp.slabs()[i].field.flux()) : bright;
            sum += shares[i];
        }
        if (!(sum > 0)) continue;
        for (double& share : shares) share /= sum;
        break;
    }
    return shares;
}

}  // namespace

std::unique_ptr<Light> make_measured_light(LightField field, CellTable table,
                                           const MeasuredSettings& settings, Monitor& monitor,
                                           std::unique_ptr<const LampShape> shape, const Workers& workers) {
    std::vector<CellTable> tables;
    tables.push_back(std::move(table));
    return make_measured_light(Lumigraph(std::move(field)), std::move(tables), settings, monitor,
                               std::move(shape), workers);
}

std::unique_ptr<Light> make_measured_light(Lumigraph lamp, std::vector<CellTable> tables,
                                           const MeasuredSettings& settings, Monitor& monitor,
                                           std::unique_ptr<const LampShape> shape, const Workers& workers) {
    const Location at{settings.file.string()};
    if (!std::isfinite(settings.power_scale) || settings.power_scale < 0) {
        input_error(at, "power scale {}; finite and not negative", settings.power_scale);
    }
    if (!std::isfinite(settings.power) || settings.power < 0) {
        input_error(at, "power {}; finite and not negative (0: as measured)", settings.power);
    }
    if (settings.reconstruction != Reconstruction::exact && settings.mode != EmissionMode::exact)
        throw InputError(at, "reconstruction \"approximate\" works with emission \"exact\" only");
    assert(tables.size() == lamp.slabs().size());
    double bright = 0;
    std::uint64_t cells = 0;
    for (std::size_t i = 0; i < tables.size(); ++i) {
        assert(tables[i].field_hash() == content_hash(lamp.slabs()[i].field));
        bright += tables[i].flux();
        cells += tables[i].cells();
    }
    if (cells > kMostCells)
        input_error(at, "slabs of {} cells together; expected at most {}", cells, kMostCells);
    const double measured = lamp.flux();
    double flux = double{settings.power};
    if (!(settings.power > 0)) {
        flux = measured * unit_factor(settings.unit, lamp.unit(), lamp.lumens_per_watt(), at);
    }
    flux *= double{settings.power_scale};
    if (!(bright > 0)) {
        if (settings.power > 0) input_error(at, "power {}: the light field is black", settings.power);
        flux = 0;
    } else if (!(measured > 0) && !(settings.power > 0)) {
        monitor.warn(fmt::format("{}: the light field's measured flux is {:.4g} {}; the lamp emits nothing",
                                 to_string(at), measured, flux_unit_name(lamp.unit())));
        flux = 0;
    }
    const std::vector<double> shares =
        flux > 0 ? shares_of(lamp, tables) : std::vector<double>(tables.size(), 0.0);
    auto light = std::make_unique<MeasuredLight>(std::move(lamp), std::move(tables), settings, flux, shares,
                                                 std::move(shape), workers);
    if (const double beside = light->beside_shape(); beside > 0.01) {
        monitor.warn(
            fmt::format("{}: {:.3g} % of the lamp's light misses its shape and starts on the sampling plane",
                        to_string(at), 100 * beside));
    }
    return light;
}

std::unique_ptr<Light> make_measured_light(const MeasuredSettings& settings, const Workers& workers,
                                           Monitor& monitor, std::unique_ptr<const LampShape> shape) {
    Lumigraph lamp = read_lumigraph(settings.file);
    std::vector<CellTable> tables =
        load_or_build_cell_tables(settings.file, fields_of(lamp), workers, monitor);
    return make_measured_light(std::move(lamp), std::move(tables), settings, monitor, std::move(shape),
                               workers);
}

}  // namespace lucerna
