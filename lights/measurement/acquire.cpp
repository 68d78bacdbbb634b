// The virtual rig: the measured irradiance of [Goesele 2003, 3.1] by quadrature.
#include "lights/measurement/acquire.h"

#include <cmath>

#include "engine/base/error.h"
#include "engine/base/memory.h"
#include "engine/base/stopped.h"
#include "lights/gauss.h"
#include "lights/measurement/acquire_part.h"
#include "lights/measurement/point_integral.h"

namespace lucerna {
namespace {

// The views whose image holds global column P, which is P - mσ for view m.
std::pair<int, int> views_of_column(const Rig& rig, int axis, int column) {
    const int sigma = rig.shift[axis];
    if (sigma == 0) return {0, rig.views[axis] - 1};
    const int over = column - rig.pixels[axis] + 1;  // least m σ
    return {over > 0 ? (over + sigma - 1) / sigma : 0, std::min(column / sigma, rig.views[axis] - 1)};
}

int global_columns(const Rig& rig, int axis) {
    return rig.pixels[axis] + (rig.views[axis] - 1) * rig.shift[axis];
}

double global_edge(const Rig& rig, int axis, int column) {
    const double sensor = rig.shift[axis] > 0 ? rig.filter(axis, 0) : 0.0;
    return sensor + (column - 0.5 * rig.pixels[axis]) * rig.pixel[axis];
}

// One pixel of the global grid on M, for all views that see it.
void acquire_pixel(const Rig& rig, const V2i& column, int rule, PointIntegral& integral,
                   FilterImages& images) {
    const auto [m0, m1] = views_of_column(rig, 0, column.x);
    const auto [n0, n1] = views_of_column(rig, 1, column.y);
    if (m0 > m1 || n0 > n1) return;  // a column between two sensors
    integral.begin({m0, n0}, {m1, n1});
    for (const GaussNode& gx : gauss_rule(rule)) {
        for (const GaussNode& gy : gauss_rule(rule)) {
            integral.add({global_edge(rig, 0, column.x) + gx.x * rig.pixel.x,
                          global_edge(rig, 1, column.y) + gy.x * rig.pixel.y},
                         gx.weight * gy.weight);
        }
    }
    const double plus = 1 / filter_scale(rig, FilterSign::positive);  // scales are > 0
    const double minus = 1 / filter_scale(rig, FilterSign::negative);
    for (int m = m0; m <= m1; ++m) {
        for (int n = n0; n <= n1; ++n) {
            const std::size_t at = rig.index(m, n, column.x - m * rig.shift.x, column.y - n * rig.shift.y);
            images.positive[at] = static_cast<float>(integral.positive(m, n) * plus);
            images.negative[at] = static_cast<float>(integral.negative(m, n) * minus);
        }
    }
}

// Calls visit(index) for the first coefficient of every row of pixels that lies in a global column of M: one
// per view that sees it, pixels.y coefficients each.
template <typename Visit>
void for_rows_of_column(const Rig& rig, int column, Visit&& visit) {
    const auto [m0, m1] = views_of_column(rig, 0, column);
    for (int m = m0; m <= m1; ++m)
        for (int n = 0; n < rig.views.y; ++n) visit(rig.index(m, n, column - m * rig.shift.x, 0));
}

// Both signs of a column as one list, for the file of unfinished work.
class ColumnValues {
  public:
    ColumnValues(FilterImages& images, int column) : images_(images), column_(column) {
        std::size_t rows = 0;
        for_rows_of_column(images.rig, column, [&](std::size_t /*first*/) { ++rows; });
        values_.resize(2 * rows * length());
    }
    bool taken_from(AcquirePart& part) {
        if (values_.empty() || !part.take(column_, values_)) return false;
        auto from = values_.begin();
        each_row([&](std::vector<float>& image, std::ptrdiff_t first) {
            std::copy_n(from, length(), image.begin() + first);
            from += static_cast<std::ptrdiff_t>(length());
        });
        return true;
    }
    void keep_in(AcquirePart& part) {
        if (values_.empty()) return;
        auto to = values_.begin();
        each_row([&](const std::vector<float>& image, std::ptrdiff_t first) {
            to = std::copy_n(image.begin() + first, length(), to);
        });
        part.keep(column_, values_);
    }

  private:
    std::size_t length() const { return static_cast<std::size_t>(images_.rig.pixels.y); }
    template <typename Visit>
    void each_row(Visit&& visit) {
        for (const FilterSign sign : kFilterSigns) {
            for_rows_of_column(images_.rig, column_, [&](std::size_t first) {
                visit(images_.of(sign), static_cast<std::ptrdiff_t>(first));
            });
        }
    }
    FilterImages& images_;
    int column_;
    std::vector<float> values_;
};

}  // namespace

FilterImages acquire_filters(const EmitterModel& emitter, const Rig& rig, const Workers& workers,
                             Monitor& monitor, const AcquireOptions& options) {
    if (const std::string fault = rig.fault(); !fault.empty()) throw InputError("rig: " + fault);
    if (!(emitter.setback >= 0) || !std::isfinite(emitter.setback)) {
        throw InputError(fmt::format("emitter: {} m behind the plane S; 0 or more", emitter.setback));
    }
    require_memory(bytes_of(rig.coefficients(), 2 * sizeof(float)),
                   fmt::format("filter images of {} coefficients", rig.coefficients()),
                   "fewer views or pixels are accepted");
    FilterImages images{rig, std::vector<float>(rig.coefficients()), std::vector<float>(rig.coefficients()),
                        emitter.info, emitter.flux};
    const V2i columns(global_columns(rig, 0), global_columns(rig, 1));
    Phase phase(monitor, "virtual acquisition", static_cast<std::uint64_t>(columns.x));
    // Each global pixel writes coefficients of its own, so columns may be done in any order.
    parallel_chunks(workers, columns.x, [&](std::int64_t chunk) {
        if (monitor.stopped()) throw Stopped("virtual acquisition: stopped");
        const int p = static_cast<int>(chunk);
        ColumnValues values(images, p);
        if (!options.part || !values.taken_from(*options.part)) {
            PointIntegral integral(emitter, rig, options.s_nodes);
            for (int q = 0; q < columns.y; ++q) acquire_pixel(rig, {p, q}, options.m_nodes, integral, images);
            if (options.part) values.keep_in(*options.part);
        }
        phase.advance(1);
    });
    return images;
}

LightField acquire(const EmitterModel& emitter, const Rig& rig, const Workers& workers, Monitor& monitor,
                   const AcquireOptions& options) {
    return field_of(acquire_filters(emitter, rig, workers, monitor, options));
}

}  // namespace lucerna
