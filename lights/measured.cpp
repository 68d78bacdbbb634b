#include "lights/measured.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>

#include "engine/base/error.h"
#include "lights/cell_emission.h"
#include "lights/placement.h"

namespace lucerna {
namespace {

class MeasuredLight final : public Light {
  public:
    MeasuredLight(LightField field, CellTable table, const MeasuredSettings& settings, double flux)
        : field_(std::move(field)),
          table_(std::move(table)),
          placement_(settings.world_from_light, field_.rig().centre, {settings.file.string()}),
          flux_(flux),
          gain_(flux > 0 ? flux / table_.flux()
                         : 0.0),  // the caller saw to it: a positive flux has a table of some
          extent_(static_cast<float>(std::sqrt(placement_.scale2()) *
                                     std::max(field_.rig().spacing.x * field_.rig().intervals(0),
                                              field_.rig().spacing.y * field_.rig().intervals(1)))),
          emission_(field_, table_, placement_, {settings.mode, flux_, gain_, extent_}) {}

    std::string_view kind() const override { return "lightfield"; }
    FluxUnit unit() const override { return field_.info().unit; }
    Rgb flux() const override { return static_cast<float>(flux_) * field_.info().colour; }
    bool has_impostor() const override { return true; }

    std::optional<Emitted> emit(const EmitU& u) const override {
        std::optional<Emitted> one;
        emit_many({&u, 1}, {&one, 1});
        return one;
    }
    void emit_many(std::span<const EmitU> u, std::span<std::optional<Emitted>> out) const override {
        if (flux_ > 0)
            emission_.emit(u, out);
        else
            std::fill(out.begin(), out.end(), std::nullopt);
    }

    std::optional<Incident> illuminate(const V3f& x, const V2f& u,
                                       std::optional<CellId> from) const override {
        if (!(flux_ > 0)) return std::nullopt;
        const Rig& rig = field_.rig();
        const V3d local = placement_.to_local_point(V3d(x));
        if (!(local.z > 0)) return std::nullopt;
        // Choose an interval of S by its share of the flux, or take the one asked for; then a point of it.
        CellTable::IntervalDraw at{0, 0, 1, u};
        if (from) {
            const std::optional<Cell> cell = table_.cell(*from);
            if (!cell) return std::nullopt;
            at.n = cell->n, at.o = cell->o;
        } else {
            at = table_.draw_interval(u);
        }
        const V2d on_s(rig.interval_edge(0, at.n) + double{at.remainder.x} * rig.spacing.x,
                       rig.interval_edge(1, at.o) + double{at.remainder.y} * rig.spacing.y);
        const V3d way(local.x - on_s.x, local.y - on_s.y, local.z);
        const V2d on_m = extend(on_s, way);
        const double radiance = radiance_along(on_s, on_m);
        if (!(radiance > 0)) return std::nullopt;
        const double distance = way.length() * std::sqrt(placement_.scale2());
        const double pdf_w = density(at.probability, way);
        const V3f w = to_float(-placement_.vector(way).normalized());
        const float margin = surface_error(x, extent_);
        return Incident{w, std::max(0.0F, static_cast<float>(distance) - margin),
                        static_cast<float>(radiance / pdf_w) * field_.info().colour,
                        static_cast<float>(pdf_w), cell_at(at.n, at.o, on_m)};
    }

    std::optional<Seen> seen(const Ray& ray) const override {
        if (!(flux_ > 0)) return std::nullopt;
        const Rig& rig = field_.rig();
        const V3d o = placement_.to_local_point(V3d(ray.o));
        const V3d d = placement_.to_local_vector(V3d(ray.d));
        if (!(o.z > 0 && d.z < 0)) return std::nullopt;
        const double t = -o.z / d.z;  // d is scaled as o is: t counts scene units
        if (!(t <= double{ray.t_max})) return std::nullopt;
        const V2d on_s(o.x + t * d.x, o.y + t * d.y);
        int interval[2];
        for (int a = 0; a < 2; ++a) {
            const double x = (on_s[a] - rig.interval_edge(a, 0)) / rig.spacing[a];
            if (!(x >= 0 && x < rig.intervals(a))) return std::nullopt;
            interval[a] = static_cast<int>(x);
        }
        const V3d way = -t * d;
        const double radiance = radiance_along(on_s, extend(on_s, way));
        if (!(radiance > 0)) return std::nullopt;
        const double pdf_w = density(double{table_.interval_probability(interval[0], interval[1])}, way);
        return Seen{static_cast<float>(radiance) * field_.info().colour, static_cast<float>(pdf_w),
                    static_cast<float>(t)};
    }

  private:
    // The ray from a point of S along `way` (way.z > 0), where it passes M. Beyond all bounds for grazing
    // ways.
    V2d extend(const V2d& on_s, const V3d& way) const {
        const double stretch = field_.rig().distance / way.z;
        return {on_s.x + way.x * stretch, on_s.y + way.y * stretch};
    }
    // In the scene: the same flux through lengths that are `scale` times as long.
    double radiance_along(const V2d& on_s, const V2d& on_m) const {
        return gain_ * double{field_.radiance(on_s, on_m)} / placement_.scale2();
    }
    // Per solid angle at the far end of `way` [light frame], for a point uniform in an interval of this
    // probability: pdf_a R² / cosθ; scale² cancels between area and R².
    double density(double probability, const V3d& way) const {
        const Rig& rig = field_.rig();
        const double r2 = way.length2();
        return probability / (rig.spacing.x * rig.spacing.y) * r2 * std::sqrt(r2) / way.z;  // way.z > 0
    }
    CellId cell_at(int n, int o, const V2d& on_m) const {
        const Rig& rig = field_.rig();
        const auto column = [&](int axis, int interval) {
            const double x = (on_m[axis] - rig.column_edge(axis, interval, 0)) / rig.pixel[axis];
            return std::clamp(static_cast<int>(x), 0, rig.columns(axis) - 1);
        };
        return table_.id({n, o, column(0, n), column(1, o)});
    }

    LightField field_;
    CellTable table_;
    Placement placement_;
    double flux_;   // of all that leaves [field's unit]
    double gain_;   // flux_ over the clamped field's
    float extent_;  // the larger side of S, scene units
    CellEmission emission_;
};

}  // namespace

std::unique_ptr<Light> make_measured_light(LightField field, CellTable table,
                                           const MeasuredSettings& settings, Monitor& monitor) {
    const Location at{settings.file.string()};
    if (!std::isfinite(settings.power_scale) || settings.power_scale < 0) {
        input_error(at, "power scale {}; finite and not negative", settings.power_scale);
    }
    if (!std::isfinite(settings.power) || settings.power < 0) {
        input_error(at, "power {}; finite and not negative (0: as measured)", settings.power);
    }
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
    return std::make_unique<MeasuredLight>(std::move(field), std::move(table), settings, flux);
}

std::unique_ptr<Light> make_measured_light(const MeasuredSettings& settings, const Workers& workers,
                                           Monitor& monitor) {
    LightField field = read_light_field(settings.file);
    CellTable table = load_or_build_cell_table(settings.file, field, workers, monitor);
    return make_measured_light(std::move(field), std::move(table), settings, monitor);
}

}  // namespace lucerna
