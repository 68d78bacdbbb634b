// Projects rays on a light field's basis [Goesele 2003, 3.1, as a sum over rays].
#include "lights/measurement/ray_projection.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>

#include "engine/base/error.h"
#include "engine/system/memory.h"
#include "lights/measurement/ray_passage.h"

namespace lucerna {
namespace {

// Accounts for what the filters over a ray miss of it. Returns the sum of squares of what they record.
double book_losses(const Passage& at, double flux, const Rig& rig, FluxAccount& account) {
    double held[2] = {0, 0}, seen[2] = {0, 0}, squares[2] = {0, 0};
    for (int axis = 0; axis < 2; ++axis) {
        at.for_each(rig, axis, [&](int, int, double weight) {
            held[axis] += weight;
            squares[axis] += weight * weight;
        });
        for (int i = 0; i < 4; ++i) {
            if (at.exists(rig, axis, i)) seen[axis] += at.weight[axis][static_cast<std::size_t>(i)];
        }
    }
    if (squares[0] * squares[1] == 0) {
        account.beside_m += flux;
        return 0;
    }
    // Weights are products of one factor per axis, and so are their sums.
    account.beside_m += flux * (seen[0] * seen[1] - held[0] * held[1]);
    account.not_in_basis += flux * (1 - seen[0] * seen[1]);
    return flux * flux * squares[0] * squares[1];
}

constexpr std::int64_t kRaysPerChunk =
    16 * 1024;  // rays per chunk; fixed, so that results do not depend on threads

void add(FluxAccount& to, const FluxAccount& more) {
    to.backward += more.backward;
    to.beside_s += more.beside_s;
    to.beside_m += more.beside_m;
    to.not_in_basis += more.not_in_basis;
}

// The rays that some filter weights, by the square of S, between neighbouring filters, that they pass.
struct RaysBySquare {
    V2i squares;                       // per axis; square -2 ... views
    std::vector<std::size_t> begin;    // of a square's rays in `order`, [across * squares.y + up]; one more
    std::vector<std::uint32_t> order;  // indices of rays
    FluxAccount account;               // of all other rays

    RaysBySquare(const RaySet& set, const Rig& rig, const Workers& workers)
        : squares(rig.views + V2i(3, 3)),
          begin(static_cast<std::size_t>(squares.x) * static_cast<std::size_t>(squares.y) + 1) {
        constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
        const auto rays = static_cast<std::int64_t>(set.rays.size());
        std::vector<std::uint32_t> square(set.rays.size(), kNone);
        std::vector<FluxAccount> accounts(
            static_cast<std::size_t>((rays + kRaysPerChunk - 1) / kRaysPerChunk));
        parallel_ranges(
            workers, rays, kRaysPerChunk, [&](std::int64_t first, std::int64_t end, std::int64_t chunk) {
                FluxAccount& lost = accounts[static_cast<std::size_t>(chunk)];
                for (auto r = static_cast<std::size_t>(first); r < static_cast<std::size_t>(end); ++r) {
                    if (!(double{set.rays[r].d.z} > kGrazingRay)) {
                        lost.backward += set.light_of(r);
                    } else if (const auto base = Passage::square_of(set.rays[r], rig)) {
                        square[r] = static_cast<std::uint32_t>((base->x + 2) * squares.y + base->y + 2);
                    } else {
                        lost.beside_s += set.light_of(r);
                    }
                }
            });
        for (const FluxAccount& lost : accounts) add(account, lost);
        for (const std::uint32_t s : square)
            if (s != kNone) ++begin[s + 1];
        std::partial_sum(begin.begin(), begin.end(), begin.begin());
        order.resize(begin.back());
        std::vector<std::size_t> next(begin.begin(), begin.end() - 1);
        for (std::size_t r = 0; r < square.size(); ++r)
            if (square[r] != kNone) order[next[square[r]]++] = static_cast<std::uint32_t>(r);
    }
};

// The sums over the rays of a square beside the coefficients.
struct SquareSum {
    FluxAccount account;
    double variance = 0;  // Σ (what a ray adds to a coefficient)²
};

// Adds the rays of one square to the sums of X, Y and Z, or of a single channel. `scale` converts flux times
// weights to W/m⁴.
SquareSum add_square(const RaySet& set, std::span<const std::uint32_t> rays, const Rig& rig,
                     const RayWeights& weights, double scale, std::vector<std::vector<double>>& sums) {
    SquareSum sum;
    const auto index_along = [&](int axis, int filter, int pixel) {
        return axis == 0 ? rig.index(filter, 0, pixel, 0) : rig.index(0, filter, 0, pixel);
    };
    for (const std::uint32_t r : rays) {
        const Passage at(set.rays[r], rig, weights);
        const Passage::Record record = at.record(rig, index_along);
        const double flux = scale * double{set.rays[r].flux};
        if (sums.size() == 1) {
            record.add(flux, sums[0]);
        } else {
            for (std::size_t c = 0; c < sums.size(); ++c)
                record.add(flux * double{set.tristimulus[r][static_cast<int>(c)]}, sums[c]);
        }
        sum.variance += book_losses(at, set.light_of(r), rig, sum.account);
    }
    return sum;
}

// Adds all rays in one order for any number of threads: squares whose numbers differ by a multiple of 4 along
// either axis share no filter.
SquareSum add_squares(const RaySet& set, const RaysBySquare& rays, const Rig& rig, const RayWeights& weights,
                      const Workers& workers, Phase& phase, std::vector<std::vector<double>>& sums) {
    const double scale = 1 / rig.cell_volume();  // > 0: Rig::fault
    std::vector<SquareSum> of_square(rays.begin.size() - 1);
    for (int first = 0; first < 16; ++first) {
        std::vector<std::size_t> squares;
        for (int x = first / 4; x < rays.squares.x; x += 4) {
            for (int y = first % 4; y < rays.squares.y; y += 4)
                squares.push_back(static_cast<std::size_t>(x * rays.squares.y + y));
        }
        parallel_each(workers, squares.size(), 1, [&](std::size_t i) {
            const std::size_t s = squares[i];
            const auto those =
                std::span(rays.order).subspan(rays.begin[s], rays.begin[s + 1] - rays.begin[s]);
            of_square[s] = add_square(set, those, rig, weights, scale, sums);
        });
        phase.advance(1);
    }
    SquareSum all;
    for (const SquareSum& of : of_square) {
        add(all.account, of.account);
        all.variance += of.variance;
    }
    add(all.account, rays.account);
    return all;
}

}  // namespace

Projection project_rays(const RaySet& set, const Rig& rig, const Workers& workers, Monitor& monitor,
                        const RayWeights& weights) {
    if (const std::string fault = rig.fault(); !fault.empty()) throw InputError("rig: " + fault);
    Phase phase(monitor, "projecting rays", 16);
    const std::size_t channels = set.coloured() ? 3 : 1;
    require_memory(bytes_of(rig.coefficients(), 2 * channels * sizeof(double)) +
                       bytes_of(set.rays.size(), 2 * sizeof(std::uint32_t)),
                   fmt::format("a light field of {} coefficients", rig.coefficients()),
                   "use fewer views or pixels");
    if (set.rays.size() >= std::numeric_limits<std::uint32_t>::max())
        throw InputError(fmt::format("{} rays; expected fewer than 2^32", set.rays.size()));
    // X, Y and Z, or a single channel.
    std::vector<std::vector<double>> sums(channels, std::vector<double>(rig.coefficients()));
    const SquareSum sum =
        add_squares(set, RaysBySquare(set, rig, workers), rig, weights, workers, phase, sums);
    std::vector<std::vector<float>> coefficients;
    for (const std::vector<double>& each : sums) coefficients.emplace_back(each.begin(), each.end());

    FluxAccount account = sum.account;
    account.total = set.flux;
    account.skipped = set.skipped_flux;
    // A coefficient is a sum of rays' contributions, so the sum of their squares estimates its variance over
    // repeated measurements. Here both are of E times a cell's volume, in units of flux.
    double square = 0;
    for (const double e : sums[channels == 3 ? 1 : 0]) square += sqr(e * rig.cell_volume());
    sums.clear();
    LightFieldInfo info;
    info.colour = set.open_colour();
    info.unit = set.unit;
    info.provenance = set.provenance;
    if (set.unit == FluxUnit::watt) info.lumens_per_watt = std::min(set.lumens_per_watt, kMostLumensPerWatt);
    LightField bare = channels == 3 ? LightField(rig, coefficients[0], coefficients[1], coefficients[2])
                                    : LightField(rig, coefficients[0]);
    if (bare.coloured()) info.colour = bare.info().colour;
    account.captured = bare.flux();
    info.captured = account.captured;
    info.missed = account.missed();
    const double noise = square > sum.variance ? std::sqrt(sum.variance / (square - sum.variance)) : INFINITY;
    return {std::move(bare).with(std::move(info)), account, noise};
}

namespace {

// The rays of one chunk that some filter weights, by the row of filters below them (base + 2).
struct Sorted {
    std::vector<std::vector<std::uint32_t>> by_base;
    FluxAccount account;

    template <typename Archive>
    void fields(Archive& archive) {
        archive(by_base, account);
    }
};

Sorted sort_chunk(std::span<const LampRay> rays, std::int64_t begin, std::int64_t end, const Rig& rig) {
    Sorted sorted;
    sorted.by_base.resize(static_cast<std::size_t>(rig.views.y) + 3);  // base = -2 ... views
    for (std::int64_t r = begin; r < end; ++r) {
        const LampRay& ray = rays[static_cast<std::size_t>(r)];
        const double flux = double{ray.flux};
        if (!(double{ray.d.z} > kGrazingRay)) {
            sorted.account.backward += flux;
            continue;
        }
        const Passage at(ray, rig);
        if (at.misses_s) {
            sorted.account.beside_s += flux;
            continue;
        }
        book_losses(at, flux, rig, sorted.account);
        sorted.by_base[static_cast<std::size_t>(at.base[1] + 2)].push_back(static_cast<std::uint32_t>(r));
    }
    return sorted;
}

// Adds a ray to the filters in row n. Returns the sum of squares of what it adds. Its tint is used for sums
// of several colours.
template <bool kColoured>
double add_to_row(const LampRay& ray, const V3f& tint, int n, FilterSums& sums) {
    const Rig& rig = sums.rig;
    const Passage at(ray, rig);
    double squares = 0;
    at.for_each(rig, 1, [&](int j, int l, double up) {
        if (at.base[1] - 1 + j != n) return;
        const double flux = double{ray.flux} * up;
        at.for_each(rig, 0, [&](int i, int k, double across) {
            const double weighed = flux * across;
            const std::size_t slot = rig.index(at.base[0] - 1 + i, n, k, l);
            if (weighed > 0) {
                sums.positive[slot] += weighed;
                if constexpr (kColoured) {
                    sums.x.positive[slot] += weighed * double{tint.x};
                    sums.z.positive[slot] += weighed * double{tint.z};
                }
            } else {
                sums.negative[slot] -= weighed;
                if constexpr (kColoured) {
                    sums.x.negative[slot] -= weighed * double{tint.x};
                    sums.z.negative[slot] -= weighed * double{tint.z};
                }
            }
            squares += weighed * weighed;
        });
    });
    return squares;
}

std::vector<std::int64_t> rows_of(const Rig& rig) {
    std::vector<std::int64_t> rows(static_cast<std::size_t>(rig.views.y));
    std::iota(rows.begin(), rows.end(), std::int64_t{0});
    return rows;
}

}  // namespace

FilterSums::FilterSums(const Rig& of) : rig(of) {
    if (const std::string fault = rig.fault(); !fault.empty()) throw InputError("rig: " + fault);
    require_memory(bytes_of(rig.coefficients(), 2 * sizeof(double)),
                   fmt::format("sums of {} coefficients", rig.coefficients()), "use fewer views or pixels");
    positive.resize(rig.coefficients());
    negative.resize(rig.coefficients());
}

void FilterSums::separate_colours() {
    if (coloured()) return;
    require_memory(bytes_of(rig.coefficients(), 4 * sizeof(double)),
                   fmt::format("sums of {} coefficients in two more channels", rig.coefficients()),
                   "use fewer views or pixels");
    const auto times = [](const std::vector<double>& of, float factor) {
        std::vector<double> to(of.size());
        std::transform(of.begin(), of.end(), to.begin(), [&](double y) { return y * double{factor}; });
        return to;
    };
    z = {times(positive, tint.z), times(negative, tint.z)};
    x = {times(positive, tint.x), times(negative, tint.x)};
}

void FilterSums::copy_from_rank_0(Ranks& ranks) {
    tint = ranks.agree(tint);
    if (ranks.agree(coloured())) separate_colours();
    for (int n = 0; n < rig.views.y; ++n) {
        Packer packer;
        if (ranks.leads()) fields_of_row(n, packer);
        const std::vector<std::byte> bytes = ranks.broadcast("filter sums", packer.take());
        Unpacker unpacker(bytes);
        if (!ranks.leads()) fields_of_row(n, unpacker);
    }
}

void FilterSums::gather(Ranks& ranks) {
    exchange(ranks, "filter sums", ResultsGo::to_rank_0, OwnedItems({1, &ranks}, rows_of(rig)).own(),
             fields());
}

bool add_rays(FilterSums& sums, std::span<const LampRay> rays, const Workers& workers,
              const RayTints& tints) {
    if (tints.rays > 0) {
        if (sums.tint == V3f(0.0F)) sums.tint = tints.first;
        if (tints.several() || !tints.like(sums.tint)) sums.separate_colours();
    }
    const auto count = static_cast<std::int64_t>(rays.size());
    std::vector<Sorted> chunks(static_cast<std::size_t>((count + kRaysPerChunk - 1) / kRaysPerChunk));
    if (!shared_chunks(
            workers, "sorted rays", static_cast<std::int64_t>(chunks.size()), ResultsGo::to_all_ranks,
            [&](std::int64_t chunk) {
                const std::int64_t begin = chunk * kRaysPerChunk;
                chunks[static_cast<std::size_t>(chunk)] =
                    sort_chunk(rays, begin, std::min(count, begin + kRaysPerChunk), sums.rig);
            },
            [&](std::int64_t chunk, auto& archive) {
                chunks[static_cast<std::size_t>(chunk)].fields(archive);
            }))
        return false;
    // Each row of filters has its own pixels and sees its rays in one order, so sums do not depend on the
    // machine.
    std::vector<double> squares(static_cast<std::size_t>(sums.rig.views.y));
    const auto add_row = [&](std::int64_t row) {
        const int n = static_cast<int>(row);
        double sum = 0;
        for (int base = n - 2; base <= n + 1; ++base) {
            for (const Sorted& chunk : chunks) {
                for (const std::uint32_t r : chunk.by_base[static_cast<std::size_t>(base + 2)]) {
                    sum += sums.coloured() ? add_to_row<true>(rays[r], tints.of(r), n, sums)
                                           : add_to_row<false>(rays[r], {}, n, sums);
                }
            }
        }
        squares[static_cast<std::size_t>(row)] = sum;
    };
    const std::vector<std::int64_t> rows = rows_of(sums.rig);
    OwnedItems owned(workers, rows);
    owned.work(workers, rows, {}, add_row);
    if (workers.ranks) {
        exchange(*workers.ranks, "squares", ResultsGo::to_all_ranks, owned.own(),
                 [&](std::int64_t row, auto& archive) { archive(squares[static_cast<std::size_t>(row)]); });
    }
    for (const double s : squares) sums.squares += s;
    for (const Sorted& chunk : chunks) add(sums.account, chunk.account);
    return true;
}

FilterImages images_of(const FilterSums& sums, double share, const LightFieldInfo& info) {
    FilterImages images;
    images.rig = sums.rig;
    images.info = info;
    // Opacity is Φ̃⊗Φ̃ over its maximum, and irradiance is flux over the pixel's area. With scale = maximum /
    // (Δ_u Δ_v) both divisions become one. Neither divisor is 0, by Rig::fault and because Φ̃ has both signs.
    const auto record = [&](const std::vector<double>& from, FilterSign sign, std::vector<float>& to) {
        const double factor = share / (filter_scale(sums.rig, sign) * sums.rig.cell_volume());
        to.resize(from.size());
        std::transform(from.begin(), from.end(), to.begin(),
                       [factor](double sum) { return static_cast<float>(factor * sum); });
    };
    record(sums.positive, FilterSign::positive, images.positive);
    record(sums.negative, FilterSign::negative, images.negative);
    if (sums.coloured()) {
        for (const auto& [from, to] : {std::pair(&sums.x, &images.x), std::pair(&sums.z, &images.z)}) {
            record(from->positive, FilterSign::positive, to->positive);
            record(from->negative, FilterSign::negative, to->negative);
        }
        images.info.colour = Rgb(1.0F);
    }
    return images;
}

SamplingNoise sampling_noise(const FilterSums& sums, double share, const LightField& field) {
    const double to_e = share / sums.rig.cell_volume();
    const double variance = to_e * to_e * sums.squares;  // of all coefficients together
    double power = 0;
    const auto add_power = [&](std::span<const float> luminances) {
        for (const float e : luminances) power += double{e} * double{e};
    };
    if (field.coloured()) {
        add_power(field.channel(1).coefficients());
    } else {
        add_power(field.coefficients());
    }
    SamplingNoise noise;
    noise.rms = std::sqrt(variance / static_cast<double>(sums.rig.coefficients()));  // at least one
    // A field that is all noise has no finite relative noise.
    noise.relative = power > variance ? std::sqrt(variance / (power - variance)) : INFINITY;
    return noise;
}

}  // namespace lucerna
