// The virtual rig: computes the measured irradiance of [Goesele 2003, 3.1] by quadrature.
#include "lights/measurement/acquire.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "engine/base/elementary.h"
#include "engine/base/error.h"
#include "engine/base/monitor.h"
#include "engine/colour/spectrum.h"
#include "engine/ranks/packing.h"
#include "engine/ranks/shared_work.h"
#include "engine/system/memory.h"
#include "engine/text/units.h"
#include "lights/gauss.h"
#include "lights/measurement/point_integral.h"

namespace lucerna {
namespace {

// Returns the first and last view whose image holds global column P, which is its column P - mσ for view m.
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

// Acquires one pixel of the global grid on M for all views that see it.
void acquire_pixel(const Rig& rig, const V2i& column, int rule, PointIntegral& integral,
                   FilterImages& images) {
    const auto [m0, m1] = views_of_column(rig, 0, column.x);
    const auto [n0, n1] = views_of_column(rig, 1, column.y);
    if (m0 > m1 || n0 > n1) return;  // the column lies between two sensors
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
    std::size_t place = 0;  // of the channel in the integral
    for (const int c : images.channels()) {
        std::vector<float>& positive = images.of(FilterSign::positive, c);
        std::vector<float>& negative = images.of(FilterSign::negative, c);
        for (int m = m0; m <= m1; ++m) {
            for (int n = n0; n <= n1; ++n) {
                const std::size_t at =
                    rig.index(m, n, column.x - m * rig.shift.x, column.y - n * rig.shift.y);
                positive[at] = static_cast<float>(integral.positive(m, n, place) * plus);
                negative[at] = static_cast<float>(integral.negative(m, n, place) * minus);
            }
        }
        ++place;
    }
}

// Calls visit(index) for the first coefficient of every row of pixels that lies in a global column of M.
// There is one per view that sees it, with pixels.y coefficients.
template <typename Visit>
void for_rows_of_column(const Rig& rig, int column, Visit&& visit) {
    const auto [m0, m1] = views_of_column(rig, 0, column);
    for (int m = m0; m <= m1; ++m)
        for (int n = 0; n < rig.views.y; ++n) visit(rig.index(m, n, column - m * rig.shift.x, 0));
}

// Lists both signs of a column, for every channel, for the file of unfinished work and for rank 0.
class ColumnValues {
  public:
    ColumnValues(FilterImages& images, int column) : images_(images), column_(column) {
        std::size_t rows = 0;
        for_rows_of_column(images.rig, column, [&](std::size_t /*first*/) { ++rows; });
        values_.resize(2 * images.channels().size() * rows * length());
    }
    std::span<float> values() { return values_; }
    void to_images() {
        auto from = values_.begin();
        each_row([&](std::vector<float>& image, std::ptrdiff_t first) {
            std::copy_n(from, length(), image.begin() + first);
            from += static_cast<std::ptrdiff_t>(length());
        });
    }
    void from_images() {
        auto to = values_.begin();
        each_row([&](const std::vector<float>& image, std::ptrdiff_t first) {
            to = std::copy_n(image.begin() + first, length(), to);
        });
    }
    bool taken_from(AcquirePart* part) {
        if (!part || values_.empty() || !part->take(column_, values_)) return false;
        to_images();
        return true;
    }
    // Stores the current values().
    void keep_in(AcquirePart* part) {
        if (part && !values_.empty()) part->keep(column_, values_);
    }

  private:
    std::size_t length() const { return static_cast<std::size_t>(images_.rig.pixels.y); }
    template <typename Visit>
    void each_row(Visit&& visit) {
        for (const int c : images_.channels()) {
            for (const FilterSign sign : kFilterSigns) {
                for_rows_of_column(images_.rig, column_, [&](std::size_t first) {
                    visit(images_.of(sign, c), static_cast<std::ptrdiff_t>(first));
                });
            }
        }
    }
    FilterImages& images_;
    int column_;
    std::vector<float> values_;
};

constexpr const char* kStopped = "virtual acquisition: stopped";

// Returns, on all ranks, the columns that rank 0's part does not have, and fills in the others at rank 0.
std::vector<std::int64_t> columns_left(Ranks* ranks, int columns, FilterImages& images, AcquirePart* part,
                                       Phase& phase) {
    std::vector<std::int64_t> left;
    for (int column = 0; (!ranks || ranks->leads()) && column < columns; ++column) {
        if (ColumnValues(images, column).taken_from(part)) {
            phase.advance(1);
        } else {
            left.push_back(column);
        }
    }
    if (!ranks) return left;
    Packer packer;
    packer(left);
    const std::vector<std::byte> bytes = ranks->broadcast("columns", packer.take());
    return Unpacker(bytes).next<std::vector<std::int64_t>>();
}

// Rank 0 gets each column as soon as it is done, and keeps it in the part like its own.
template <typename Acquire>
void acquire_columns(const Workers& workers, Monitor& monitor, int columns, FilterImages& images,
                     AcquirePart* part, Phase& phase, Acquire&& acquire) {
    Ranks* const ranks = workers.ranks;
    Ranks::Loop loop;
    loop.shared = columns_left(ranks, columns, images, part, phase);
    loop.ends = [&] { return ranks ? ranks->asked_to_stop() : monitor.stopped(); };
    loop.made = [&images](std::int64_t column) {
        ColumnValues values(images, static_cast<int>(column));
        values.from_images();
        const auto bytes = std::as_bytes(values.values());
        return std::vector<std::byte>(bytes.begin(), bytes.end());
    };
    loop.arrived = [&](std::int64_t column, int /*rank*/, std::span<const std::byte> made) {
        ColumnValues values(images, static_cast<int>(column));
        Unpacker unpacker(made);
        auto to = values.values();
        unpacker(to);
        values.to_images();
        values.keep_in(part);
    };
    loop.advance = [&phase](std::int64_t more) { phase.advance(static_cast<std::uint64_t>(more)); };
    const auto done = shared_loop(workers, loop, [&](std::int64_t column) {
        acquire(static_cast<int>(column));
        return true;
    });
    if (ranks ? ranks->agree_to_stop() : done.size() < loop.shared.size()) throw Stopped(kStopped);
}

}  // namespace

FilterImages acquire_filters(const EmitterModel& emitter, const Rig& rig, const Workers& workers,
                             Monitor& monitor, const AcquireOptions& options) {
    if (const std::string fault = rig.fault(); !fault.empty()) throw InputError("rig: " + fault);
    if (!(emitter.setback >= 0) || !std::isfinite(emitter.setback)) {
        throw InputError(fmt::format("emitter: {} m behind the plane S; 0 or more", emitter.setback));
    }
    FilterImages images;
    images.rig = rig;
    images.info = emitter.info;
    images.flux = emitter.flux;
    images.allocate(bool(emitter.xyz));
    const V2i columns(global_columns(rig, 0), global_columns(rig, 1));
    Phase phase(monitor, "virtual acquisition", static_cast<std::uint64_t>(columns.x));
    // Each global pixel writes its own coefficients, so the order of columns does not matter.
    const auto acquire_column = [&](int p) {
        PointIntegral integral(emitter, rig, options.s_nodes);
        for (int q = 0; q < columns.y; ++q) acquire_pixel(rig, {p, q}, options.m_nodes, integral, images);
        if (!options.part) return;
        ColumnValues values(images, p);
        values.from_images();
        values.keep_in(options.part);
    };
    acquire_columns(workers, monitor, columns.x, images, options.part, phase, acquire_column);
    return images;
}

LightField acquire(const EmitterModel& emitter, const Rig& rig, const Workers& workers, Monitor& monitor,
                   const AcquireOptions& options) {
    return field_of(acquire_filters(emitter, rig, workers, monitor, options));
}

namespace {

// Returns the CIE XYZ of the emitter's radiance along the ray from a point of S to M; for an emitter of one
// colour, only Y is set.
V3d radiance_through(const EmitterModel& emitter, const Rig& rig, const V2d& on_s, const V2d& on_m) {
    const V2d on_emitter = on_s - (on_m - on_s) * (emitter.setback / rig.distance);          // distance > 0
    const V2d part(on_emitter.x / emitter.half_size.x, on_emitter.y / emitter.half_size.y);  // > 0
    const bool inside = emitter.outline == EmitterModel::Outline::disc
                            ? part.length2() <= 1
                            : std::max(std::fabs(part.x), std::fabs(part.y)) <= 1;
    if (!inside) return V3d(0);
    const V3d direction = V3d(on_m.x - on_s.x, on_m.y - on_s.y, rig.distance).normalized();
    return emitter.xyz ? emitter.xyz(on_emitter, direction)
                       : V3d(0, emitter.radiance(on_emitter, direction), 0);
}

}  // namespace

LightField acquire_without_filter(const EmitterModel& emitter, const Rig& filtered, const Workers& workers,
                                  Monitor& monitor, const AcquireOptions& options) {
    Rig rig = filtered;
    rig.filter_basis = FilterBasis::hat;
    if (rig.shift == V2i(0, 0)) rig.basis = PixelBasis::hat;
    if (const std::string fault = rig.fault(); !fault.empty()) throw InputError("rig: " + fault);
    const bool coloured = bool(emitter.xyz);
    require_memory(bytes_of(rig.coefficients(), (coloured ? 6 : 2) * sizeof(float)),
                   fmt::format("a light field of {} coefficients", rig.coefficients()),
                   "use fewer views or pixels");
    std::array<std::vector<float>, 3> e;  // X, Y, Z
    for (const std::size_t c : {0U, 1U, 2U})
        if (coloured || c == 1) e[c].resize(rig.coefficients());
    Phase phase(monitor, "virtual acquisition", static_cast<std::uint64_t>(rig.views.x));
    const auto acquire_views = [&](std::int64_t chunk) {
        if (!workers.ranks && monitor.stopped()) throw Stopped(kStopped);
        const int m = static_cast<int>(chunk);
        for (int n = 0; n < rig.views.y; ++n) {
            const V2d on_s(rig.filter(0, m), rig.filter(1, n));
            for (int k = 0; k < rig.pixels.x; ++k) {
                for (int l = 0; l < rig.pixels.y; ++l) {
                    V3d mean(0);
                    for (const GaussNode& gx : gauss_rule(options.m_nodes)) {
                        for (const GaussNode& gy : gauss_rule(options.m_nodes)) {
                            // Pixel k of a view is column k of the interval above its filter.
                            const V2d on_m(rig.column_edge(0, m + 1, k) + gx.x * rig.pixel.x,
                                           rig.column_edge(1, n + 1, l) + gy.x * rig.pixel.y);
                            mean += radiance_through(emitter, rig, on_s, on_m) *
                                    (gx.weight * gy.weight * rig.geometric_term(on_s, on_m));
                        }
                    }
                    for (int c = 0; c < 3; ++c) {
                        std::vector<float>& channel = e[static_cast<std::size_t>(c)];
                        if (!channel.empty()) channel[rig.index(m, n, k, l)] = static_cast<float>(mean[c]);
                    }
                }
            }
        }
    };
    const std::size_t in_views = rig.coefficients() / static_cast<std::size_t>(rig.views.x);
    const auto fields = [&](std::int64_t m, auto& archive) {
        for (std::vector<float>& channel : e) {
            if (channel.empty()) continue;
            auto own = std::span(channel).subspan(static_cast<std::size_t>(m) * in_views, in_views);
            archive(own);
        }
    };
    if (!shared_chunks(workers, "views", rig.views.x, ResultsGo::to_all_ranks, acquire_views, fields,
                       [&](std::int64_t more) { phase.advance(static_cast<std::uint64_t>(more)); }))
        throw Stopped(kStopped);
    double sum = 0;
    for (const float y : e[1]) sum += double{y};
    LightFieldInfo info = emitter.info;
    info.captured = sum * rig.cell_volume();
    info.missed = emitter.flux - info.captured;
    // A lamp smaller than the pinholes' spacing may face none of them, and a dark field has no colours.
    if (!coloured || !(sum > 0)) return {rig, std::move(e[1]), std::move(info)};
    return {rig, std::move(e[0]), std::move(e[1]), std::move(e[2]), std::move(info)};
}

EmitterModel cosine_emitter(EmitterModel::Outline outline, const V2d& half_size, double flux, double exponent,
                            std::function<double(const V2d&)> pattern) {
    const bool disc = outline == EmitterModel::Outline::disc;
    const V2d half = disc ? V2d(half_size.x, half_size.x) : half_size;
    if (!(half.x > 0 && half.y > 0) || !std::isfinite(half.x) || !std::isfinite(half.y)) {
        throw InputError(
            fmt::format("emitter: a half size of {} by {} m; finite and positive", half.x, half.y));
    }
    if (!(flux > 0) || !std::isfinite(flux))
        throw InputError(fmt::format("emitter: a flux of {}; positive", flux));
    if (!(exponent >= 1) || !std::isfinite(exponent)) {
        throw InputError(fmt::format("emitter: a lobe exponent of {}; 1 (Lambertian) or more", exponent));
    }
    // The pattern's mean over the outline comes from the midpoint rule.
    double mean = 1;
    if (pattern) {
        constexpr int kSide = 512;
        double sum = 0;
        int points = 0;
        for (int i = 0; i < kSide * kSide; ++i) {
            const V2d p(2 * (i % kSide + 0.5) / kSide - 1,
                        2 * (static_cast<double>(i / kSide) + 0.5) / kSide - 1);
            if (disc && p.length2() > 1) continue;
            sum += pattern(p);
            ++points;
        }
        mean = sum / points;
        if (!(mean > 0) || !std::isfinite(mean))
            throw InputError(fmt::format("emitter: a pattern of mean {}", mean));
    }
    // The flux is A L0 ∫ cos^exponent dω = A L0 2π / (exponent + 1).
    const double area = disc ? kPiD * half.x * half.x : 4 * half.x * half.y;
    const double l0 = flux * (exponent + 1) / (2 * kPiD * area * mean);
    EmitterModel emitter;
    emitter.outline = outline;
    emitter.half_size = half;
    emitter.flux = flux;
    emitter.radiance = [=](const V2d& position, const V3d& direction) {
        const double lobe = exponent == 1 ? 1.0 : pow(std::max(0.0, direction.z), exponent - 1);
        return l0 * lobe * (pattern ? pattern({position.x / half.x, position.y / half.y}) : 1.0);
    };
    emitter.info.provenance = fmt::format("computed: {} of {:g} x {:g} m, cosine power {:g}",
                                          disc ? "disc" : "rectangle", 2 * half.x, 2 * half.y, exponent);
    return emitter;
}

void set_colours(EmitterModel& emitter, const ColourCourse& colours) {
    emitter.info.colour = colours.middle;
    emitter.xyz = {};
    if (!colours.varies()) return;
    const V3d middle = rgb_to_xyz(colours.middle), rim = rgb_to_xyz(colours.rim.value_or(colours.middle));
    const auto grazing = colours.grazing ? std::optional(rgb_to_xyz(*colours.grazing)) : std::nullopt;
    const double corner = emitter.outline == EmitterModel::Outline::disc ? 1 : 2;
    emitter.info.colour = Rgb(1.0F);
    emitter.xyz = [=, radiance = emitter.radiance, half = emitter.half_size](const V2d& p, const V3d& d) {
        // Rounding may put nodes of the quadrature slightly outside the rim.
        const double to_rim = std::min(1.0, (sqr(p.x / half.x) + sqr(p.y / half.y)) / corner);
        const V3d here = middle + to_rim * (rim - middle);
        return radiance(p, d) * (grazing ? here + (1 - d.z) * (*grazing - here) : here);
    };
}

namespace {

// A slide's transmittance in one channel, with a dark frame one texel wide, so that four neighbours always
// exist. Rows run down.
class ProjectedSlide {
  public:
    // `value` maps each of the picture's pixels.
    template <typename Value>
    ProjectedSlide(const Image& picture, Value&& value)
        : width_(picture.width),
          height_(picture.height),
          stride_(static_cast<std::size_t>(picture.width) + 2),
          texels_(stride_ * (static_cast<std::size_t>(picture.height) + 2)) {
        for (int y = 0; y < height_; ++y)
            for (int x = 0; x < width_; ++x) texels_[at(x, y)] = value(picture.rgb_at(x, y), x, y);
    }
    int width() const { return width_; }
    int height() const { return height_; }
    double texel(int x, int y) const { return double{texels_[at(x, y)]}; }

    // Interpolates bilinearly between texel centres; x and y are in texels from the upper left corner.
    double value(double x, double y) const {
        x -= 0.5;
        y -= 0.5;
        if (!(x > -1 && x < width_ && y > -1 && y < height_)) return 0;  // also refuses NaN
        const double column = std::floor(x), row = std::floor(y);
        const double fx = x - column, fy = y - row;
        const float* t = &texels_[at(static_cast<int>(column), static_cast<int>(row))];
        const double upper = double{t[0]} + fx * (double{t[1]} - double{t[0]});
        const double lower = double{t[stride_]} + fx * (double{t[stride_ + 1]} - double{t[stride_]});
        return upper + fy * (lower - upper);
    }

  private:
    std::size_t at(int x, int y) const {  // x and y start at -1
        return static_cast<std::size_t>(y + 1) * stride_ + static_cast<std::size_t>(x + 1);
    }
    int width_, height_;
    std::size_t stride_;
    std::vector<float> texels_;
};

float let_through(float value, bool inverted, int x, int y) {
    if (!(value >= 0 && value <= 1.0001F)) {
        throw InputError(
            fmt::format("slide: a value of {} in column {}, row {}; expected 0 to 1", value, x, y));
    }
    return inverted ? std::max(0.0F, 1 - value) : value;
}

// Returns true if the picture has no colours beyond rounding.
bool is_grey(const Image& picture) {
    constexpr float kRounding = 1e-5F;
    for (int y = 0; y < picture.height; ++y) {
        for (int x = 0; x < picture.width; ++x) {
            const Rgb c = picture.rgb_at(x, y);
            if (!(std::max({c.x, c.y, c.z}) - std::min({c.x, c.y, c.z}) <= kRounding)) return false;
        }
    }
    return true;
}

// Returns X, Y and Z of the light behind a coloured slide.
std::shared_ptr<const std::array<ProjectedSlide, 3>> slide_in_colours(const Projector& projector,
                                                                      const Image& picture) {
    const auto channel = [&](int c) {
        return ProjectedSlide(picture, [&](const Rgb& value, int x, int y) {
            Rgb light;
            for (int k = 0; k < 3; ++k)
                light[k] = projector.colour[k] * let_through(value[k], projector.inverted, x, y);
            return static_cast<float>(rgb_to_xyz(light)[c]);
        });
    };
    return std::make_shared<const std::array<ProjectedSlide, 3>>(
        std::array<ProjectedSlide, 3>{channel(0), channel(1), channel(2)});
}

void check(const Projector& projector, const Image& picture) {
    const auto length = [](double x) { return std::isfinite(x) && x > 0; };
    if (!length(projector.aperture) || !length(projector.focal_length) || !length(projector.focus) ||
        !length(projector.slide_size.x) || !length(projector.slide_size.y) || !length(projector.flux) ||
        !std::isfinite(projector.setback) || projector.setback < 0) {
        throw InputError("projector: lengths and flux must be positive and finite");
    }
    if (!(projector.focus > projector.focal_length)) {
        throw InputError(fmt::format("projector: in focus at {}; expected more than its focal length of {}",
                                     length_text(projector.focus), length_text(projector.focal_length)));
    }
    if (picture.width < 1 || picture.height < 1) throw InputError("slide: it has no pixels");
}

// Returns ∫ b²/R⁴ over the lens, from a point of the plane in focus at squared distance off2 from the axis:
// the irradiance there for a radiance of 1. It is the form factor of a disc seen from a parallel plane; the
// root is > 0 because b > 0.
double lens_seen_from(const Projector& projector, double off2) {
    const double b2 = projector.focus * projector.focus, r2 = projector.aperture * projector.aperture;
    const double sum = off2 + b2 + r2;
    return 0.5 * kPiD * (1 - (off2 + b2 - r2) / std::sqrt(sum * sum - 4 * r2 * off2));
}

}  // namespace

EmitterModel projector_emitter(const Projector& projector, const Image& picture) {
    check(projector, picture);
    std::shared_ptr<const std::array<ProjectedSlide, 3>> colours;
    std::shared_ptr<const ProjectedSlide> slide;  // of luminance
    if (is_grey(picture)) {
        slide = std::make_shared<const ProjectedSlide>(picture, [&](const Rgb& value, int x, int y) {
            return let_through(luminance(value), projector.inverted, x, y);
        });
    } else {
        colours = slide_in_colours(projector, picture);
        slide = {colours, &(*colours)[1]};
    }
    // Texels per metre on the plane in focus; one over their product is a texel's area.
    const V2d per_metre(slide->width() / (projector.slide_size.x * projector.magnification()),
                        slide->height() / (projector.slide_size.y * projector.magnification()));
    const V2d middle(0.5 * slide->width(), 0.5 * slide->height());
    double flux = 0;  // for a radiance of 1 behind a clear slide
    for (int y = 0; y < slide->height(); ++y) {
        for (int x = 0; x < slide->width(); ++x) {
            const V2d q((x + 0.5 - middle.x) / per_metre.x, (y + 0.5 - middle.y) / per_metre.y);
            flux += slide->texel(x, y) * lens_seen_from(projector, q.length2());
        }
    }
    flux /= per_metre.x * per_metre.y;
    if (!(flux > 0) || !std::isfinite(flux)) throw InputError("slide: it transmits no light");

    EmitterModel emitter;
    emitter.outline = EmitterModel::Outline::disc;
    emitter.half_size = {projector.aperture, projector.aperture};
    emitter.setback = projector.setback;
    emitter.flux = projector.flux;
    emitter.info.colour = projector.colour;
    emitter.radiance = [=, clear = projector.flux / flux, b = projector.focus](const V2d& p, const V3d& d) {
        const double way = b / d.z;  // d.z > 0
        return clear * slide->value(middle.x + (p.x + d.x * way) * per_metre.x,
                                    middle.y - (p.y + d.y * way) * per_metre.y);
    };
    if (colours) {
        emitter.info.colour = Rgb(1.0F);
        emitter.xyz = [=, clear = projector.flux / flux, b = projector.focus](const V2d& p, const V3d& d) {
            const double way = b / d.z;  // d.z > 0
            const V2d at(middle.x + (p.x + d.x * way) * per_metre.x,
                         middle.y - (p.y + d.y * way) * per_metre.y);
            V3d xyz;
            for (std::size_t c = 0; c < 3; ++c)
                xyz[static_cast<int>(c)] = clear * (*colours)[c].value(at.x, at.y);
            return xyz;
        };
    }
    emitter.info.provenance =
        fmt::format("virtual acquisition of a slide projector: aperture {}, focal length {}, sharp at {}",
                    length_text(2 * projector.aperture), length_text(projector.focal_length),
                    length_text(projector.focus));
    return emitter;
}

}  // namespace lucerna
