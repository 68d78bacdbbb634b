#include "lights/measured.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>

#include "engine/base/error.h"
#include "lights/cell_emission.h"
#include "lights/emission_net.h"
#include "lights/field_pyramid.h"

namespace lucerna {
namespace {

class MeasuredLight final : public Light {
  public:
    MeasuredLight(LightField field, CellTable table, const MeasuredSettings& settings, double flux,
                  std::unique_ptr<const LampShape> shape, const Workers& workers)
        : field_(std::move(field)),
          colour_(field_, workers, settings.colours),
          table_(std::move(table)),
          placement_(settings.world_from_light, field_.rig().centre, {settings.file.string()}),
          flux_(flux),
          gain_(flux > 0 ? flux / table_.flux()
                         : 0.0),  // the caller saw to it: a positive flux has a table of some
          extent_(static_cast<float>(
              std::sqrt(placement_.scale2()) * 2 *
              std::max(-field_.rig().interval_edge(0, 0), -field_.rig().interval_edge(1, 0)))),
          reconstruction_(settings.reconstruction),
          shape_(std::move(shape)),
          emission_(field_, colour_, table_, placement_, {settings.mode, flux_, gain_, extent_}) {
        if (flux_ > 0) pyramid_.emplace(field_, table_, kPartsAcross, workers);
    }

    std::string_view kind() const override { return "lightfield"; }
    FluxUnit unit() const override { return field_.info().unit; }
    Rgb flux() const override { return static_cast<float>(flux_) * colour_.mean(); }
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
        emission_.sample_Le_many(u, out);
        if (reconstruction_ != Reconstruction::exact) reconstruct(out);
        if (shape_) lift(out);
    }

    // The share of the flux along lines that miss the shape, estimated.
    double beside_shape() const {
        constexpr std::size_t kLines = 4096;
        if (!shape_ || !(flux_ > 0)) return 0;
        std::vector<LeSampleU> u;
        const EmissionNet net(0, Purpose::emission, 0);
        for (std::uint32_t i = 0; i < kLines; ++i) u.push_back(net.at(i).u);
        std::vector<std::optional<LeSample>> out(kLines);
        emission_.sample_Le_many(u, out);
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
        const V3d local = placement_.to_local_point(V3d(x));
        if (!(local.z > 0 || shape_)) return std::nullopt;
        if (local.z == 0) return std::nullopt;
        std::optional<V2i> within;
        if (from) {
            const std::optional<Cell> cell = table_.cell(*from);
            if (!cell) return std::nullopt;
            within = V2i(cell->n, cell->o);
        }
        const auto drawn = pyramid_->draw(local, u, within);
        if (!drawn) return std::nullopt;
        const Line line{
            drawn->on_s, {local.x - drawn->on_s.x, local.y - drawn->on_s.y, local.z}, drawn->n, drawn->o};
        const Radiance radiance = radiance_along(line);
        if (!radiance.any()) return std::nullopt;
        const double distance = distance_to_origin(line, x);
        if (!(distance > 0)) return std::nullopt;
        const PartPdf part = per_solid_angle(line, drawn->density);
        const float pdf_w = from ? part.part_pdf_w : part.whole_pdf_w;
        const auto weight = static_cast<float>(radiance.scale / double{pdf_w});
        if (!std::isfinite(weight)) return std::nullopt;  // a density that float32 takes for 0
        return LightSample{to_float(-direction_of(line)),
                           static_cast<float>(distance),
                           weight * radiance.colour,
                           pdf_w,
                           cell_at(line),
                           part};
    }

    CellId part_of(CellId id) const override {
        const std::optional<Cell> cell = table_.cell(id);
        return cell && pyramid_ ? name_of(cell->n, cell->o) : kNoCell;
    }

    // S, and the widest angle of a line to its normal. On a shape light may begin anywhere along a line.
    std::optional<LightBounds> bounds() const override {
        if (shape_) return std::nullopt;
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
        bounds.theta_o = static_cast<float>(std::atan2(std::sqrt(across2), rig.distance));
        bounds.theta_e = 0;
        return bounds;
    }

    // S itself, where the line of the ray does not cross the shape.
    std::optional<EmittedRadiance> Le(const Ray& ray) const override {
        const auto line = line_of(ray);
        if (!line || !(line->way.z > 0)) return std::nullopt;
        const V3d way = placement_.vector(line->way);
        const double t = way.length();
        if (!(t <= double{ray.t_max})) return std::nullopt;
        const EmittedRadiance found = found_along(*line, static_cast<float>(t));
        if (!(luminance(found.radiance) > 0)) return std::nullopt;
        if (shape_ && shape_->last_crossing(placement_.point(line->on_s), direction_of(*line)))
            return std::nullopt;
        return found;
    }

    // The shape, where the light of the ray's line begins on it and not further on.
    EmittedRadiance Le_on_surface(const Ray& ray, float t, const V3f& /*n*/) const override {
        const EmittedRadiance dark{Rgb(0.0F), 0, t};
        const auto line = line_of(ray);
        if (!line || !shape_) return dark;
        const EmittedRadiance found = found_along(*line, t);
        if (!(luminance(found.radiance) > 0)) return dark;
        const V3d along = direction_of(*line);
        const auto origin = shape_->last_crossing(placement_.point(line->on_s), along);
        if (!origin) return dark;
        const double beyond = (V3d(origin->p) - V3d(ray.o)).dot(-along) - double{t};
        return beyond > -kSameCrossing * double{shape_->extent()} ? found : dark;
    }

  private:
    // Two crossings of a line nearer than this share of the shape's extent are one.
    static constexpr double kSameCrossing = 1e-4;

    // Parts are blocks of intervals, so large that there are at most so many across S: finer ones would be
    // more than a few dozen photons can tell apart.
    static constexpr int kPartsAcross = 16;

    // A line of the field: its point of S, and the way from there to a point elsewhere on it, which lies
    // behind S if way.z < 0. Light frame.
    struct Line {
        V2d on_s;
        V3d way;
        int n = 0, o = 0;  // the interval of S
    };

    CellId name_of(int n, int o) const {
        const V2i part = pyramid_->part_of(n, o);
        return table_.id({part.x, part.y, 0, 0});
    }

    // Of the light along the line: its direction in the scene.
    V3d direction_of(const Line& line) const {
        const V3d d = placement_.vector(line.way).normalized();
        return line.way.z > 0 ? d : -d;
    }

    // The line of a ray that runs against the light, with the way to where the ray begins. None if it misses
    // S.
    std::optional<Line> line_of(const Ray& ray) const {
        if (!(flux_ > 0)) return std::nullopt;
        const Rig& rig = field_.rig();
        const V3d o = placement_.to_local_point(V3d(ray.o));
        const V3d d = placement_.to_local_vector(V3d(ray.d));
        if (!(d.z < 0)) return std::nullopt;
        const double t = -o.z / d.z;  // d is scaled as o is: t counts scene units
        Line line{{o.x + t * d.x, o.y + t * d.y}, -t * d, 0, 0};
        for (int a = 0; a < 2; ++a) {
            const double x = rig.intervals_to(a, line.on_s[a]);
            if (!(x >= 0 && x < rig.intervals(a))) return std::nullopt;
            (a == 0 ? line.n : line.o) = static_cast<int>(x);
        }
        return line;
    }

    // What a ray along the line sees at distance t, and how probable sample_Li() makes it.
    EmittedRadiance found_along(const Line& line, float t) const {
        const Radiance radiance = radiance_along(line);
        if (!radiance.any()) return {Rgb(0.0F), 0, t};
        const V3d x(line.on_s.x + line.way.x, line.on_s.y + line.way.y, line.way.z);
        const PartPdf part = per_solid_angle(line, pyramid_->density(x, line.on_s));
        return {static_cast<float>(radiance.scale) * radiance.colour, part.whole_pdf_w, t, part};
    }

    // How far the way from x to where the line's light begins must be free; nothing above 0 if x lies behind
    // that.
    double distance_to_origin(const Line& line, const V3f& x) const {
        if (shape_) {
            const V3d along = direction_of(line);
            const auto origin = shape_->last_crossing(placement_.point(line.on_s), along);
            if (origin) {
                // The ray ends where it is `gap` in front of the shape; a grazing one (cosine 0) gives -inf.
                const double gap = double{origin->error} + double{surface_error(x, shape_->extent())};
                const double cosine = std::fabs(V3d(origin->n).dot(along));
                return (V3d(x) - V3d(origin->p)).dot(along) - gap / cosine;
            }
        }
        if (!(line.way.z > 0)) return 0;
        const double distance = line.way.length() * std::sqrt(placement_.scale2());
        return std::max(0x1p-126, distance - double{surface_error(x, extent_)});
    }

    // Particles of the exact reconstruction become those of the other one.
    void reconstruct(std::span<std::optional<LeSample>> particles) const {
        for (auto& particle : particles) {
            if (!particle) continue;
            const V3d p = placement_.to_local_point(V3d(particle->from.p));
            const V3d d = placement_.to_local_vector(V3d(particle->d));
            const Line line{{p.x, p.y}, d, 0, 0};
            if (!(d.z > 0)) continue;  // rounded: a line along S
            particle->weight *= field_.over_exact(reconstruction_, line.on_s, on_m(line));
        }
    }

    // Particles start where their lines last cross the shape.
    void lift(std::span<std::optional<LeSample>> particles) const {
        for (auto& particle : particles) {
            if (!particle) continue;
            if (const auto origin = shape_->last_crossing(V3d(particle->from.p), V3d(particle->d))) {
                particle->from = *origin;
            }
        }
    }

    // Where the line passes M. Beyond all bounds for grazing ones. way.z != 0.
    V2d on_m(const Line& line) const {
        const double stretch = field_.rig().distance / line.way.z;
        return {line.on_s.x + line.way.x * stretch, line.on_s.y + line.way.y * stretch};
    }
    // In the scene: the same flux through lengths that are `scale` times as long.
    struct Radiance {
        double scale = 0;
        Rgb colour{0};
        bool any() const { return scale > 0 && luminance(colour) > 0; }
    };
    Radiance radiance_along(const Line& line) const {
        if (line.way.z == 0) return {};  // a point of S: no line
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
    // At the far end of the way [light frame]: pdf_a R² / cosθ; scale² cancels between area and R².
    PartPdf per_solid_angle(const Line& line, const FieldPyramid::Density& density) const {
        const double r2 = line.way.length2();
        // Only asked where there is radiance, and so a way.
        const double per_area = r2 * std::sqrt(r2) / std::fabs(line.way.z);
        return {name_of(line.n, line.o), static_cast<float>(density.whole * per_area),
                static_cast<float>(density.part * per_area)};
    }
    CellId cell_at(const Line& line) const {
        const Rig& rig = field_.rig();
        const V2d m = on_m(line);
        // Of the light beyond the outermost columns' edges these are the nearest.
        const auto column = [&](int axis, int interval) {
            const double x = rig.columns_to(axis, interval, m[axis]);
            return static_cast<int>(std::clamp(x, 0.0, rig.columns(axis) - 1.0));
        };
        return table_.id({line.n, line.o, column(0, line.n), column(1, line.o)});
    }

    LightField field_;
    FieldColour colour_;
    CellTable table_;
    Placement placement_;
    double flux_;                          // of all that leaves [field's unit]
    double gain_;                          // flux_ over the clamped field's
    float extent_;                         // the larger side of S, scene units
    std::optional<FieldPyramid> pyramid_;  // none of a lamp that is dark
    Reconstruction reconstruction_;
    std::unique_ptr<const LampShape> shape_;  // may be null
    CellEmission emission_;
};

}  // namespace

std::unique_ptr<Light> make_measured_light(LightField field, CellTable table,
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
        throw InputError(at, "reconstruction \"approximate\" is accepted with emission \"exact\" alone");
    assert(table.field_hash() == content_hash(field));
    const double measured = field.flux();
    double flux = settings.power > 0 ? double{settings.power} : measured * double{settings.power_scale};
    if (!(table.flux() > 0)) {
        if (settings.power > 0) input_error(at, "power {}: the light field is black", settings.power);
        flux = 0;
    } else if (!(measured > 0) && !(settings.power > 0)) {
        monitor.warn(fmt::format("{}: the light field's measured flux is {:.4g} {}; the lamp stays dark",
                                 to_string(at), measured, flux_unit_name(field.info().unit)));
        flux = 0;
    }
    auto light = std::make_unique<MeasuredLight>(std::move(field), std::move(table), settings, flux,
                                                 std::move(shape), workers);
    if (const double beside = light->beside_shape(); beside > 0.01) {
        monitor.warn(
            fmt::format("{}: {:.3g} % of the lamp's light misses its shape and begins on the sampling plane",
                        to_string(at), 100 * beside));
    }
    return light;
}

std::unique_ptr<Light> make_measured_light(const MeasuredSettings& settings, const Workers& workers,
                                           Monitor& monitor, std::unique_ptr<const LampShape> shape) {
    LightField field = read_light_field(settings.file);
    CellTable table = load_or_build_cell_table(settings.file, field, workers, monitor);
    return make_measured_light(std::move(field), std::move(table), settings, monitor, std::move(shape),
                               workers);
}

}  // namespace lucerna
