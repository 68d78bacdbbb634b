#include "lights/measurement/spectral_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <span>

#include "engine/base/sampler.h"
#include "engine/base/stats.h"
#include "lights/measurement/ray_projection.h"

namespace lucerna {
namespace {

constexpr std::size_t kMostRays = 1 << 21, kMostCells = 256, kRaysOfCell = 512;
constexpr double kWanted = 0.01;           // relative error of the spectra that suffices
constexpr double kLeastSeparation = 0.03;  // below, noise of XYZ would decide on the mixture
constexpr std::size_t kGroup = 4;          // bands of an interval of 20 nm, in which errors count

using Cells = std::vector<BandSpectrum>;

// Returns each spectrum per unit of the rays' flux, in bands; 0 where that has no meaning.
Cells per_flux(const RaySet& set) {
    Cells cells;
    for (const Spectrum& spectrum : set.spectra) {
        BandSpectrum bands = banded(spectrum);
        const double flux = set.unit == FluxUnit::watt ? spectrum_watts(spectrum) : band_lumens(bands);
        cells.push_back(flux > 0 ? (1 / flux) * bands : BandSpectrum());
    }
    return cells;
}

// A ray by where it passes closest to the lamp's middle, and by its direction.
using RayPlace = std::array<float, 6>;

std::vector<RayPlace> places_of(const RaySet& set) {
    V3d middle(0, 0, 0);
    double flux = 0;
    for (const LampRay& ray : set.rays) middle += double{ray.flux} * V3d(ray.o), flux += double{ray.flux};
    if (flux > 0) middle /= flux;
    std::vector<RayPlace> places;
    double spread = 0;
    for (const LampRay& ray : set.rays) {
        const V3d o = V3d(ray.o) - middle, d(ray.d);
        const V3d near = o - o.dot(d) * d;
        spread += double{ray.flux} * near.length2();
        places.push_back({static_cast<float>(near.x), static_cast<float>(near.y), static_cast<float>(near.z),
                          ray.d.x, ray.d.y, ray.d.z});
    }
    const double unit = flux > 0 && spread > 0 ? std::sqrt(flux / spread) : 0;
    for (RayPlace& place : places) {
        for (std::size_t a = 0; a < 3; ++a) place[a] = static_cast<float>(unit * double{place[a]});
    }
    return places;
}

// Divides rays into halves along the coordinate that varies most, again and again, and gives each its cell.
void divide(std::span<std::uint32_t> rays, const std::vector<RayPlace>& places, std::size_t cells,
            std::uint32_t first, std::vector<std::uint32_t>& cell_of) {
    if (cells == 1) {
        for (const std::uint32_t ray : rays) cell_of[ray] = first;
        return;
    }
    std::size_t axis = 0;
    double most = -1;
    for (std::size_t a = 0; a < 6; ++a) {
        RunningStats values;
        for (const std::uint32_t ray : rays) values.add(double{places[ray][a]});
        if (values.variance() > most) axis = a, most = values.variance();
    }
    const auto middle = rays.begin() + static_cast<std::ptrdiff_t>(rays.size() / 2);
    std::nth_element(rays.begin(), middle, rays.end(), [&](std::uint32_t a, std::uint32_t b) {
        return std::pair(places[a][axis], a) < std::pair(places[b][axis], b);
    });
    divide({rays.begin(), middle}, places, cells / 2, first, cell_of);
    divide({middle, rays.end()}, places, cells / 2, first + static_cast<std::uint32_t>(cells / 2), cell_of);
}

// The spectra of the cells by half of the rays, for the choice, and by two quarters, for its error.
struct CellSpectra {
    Cells choosing, first, second;

    Cells all() const {
        Cells sum = choosing;
        for (std::size_t c = 0; c < sum.size(); ++c) (sum[c] += first[c]) += second[c];
        return sum;
    }
};

CellSpectra cell_spectra(const RaySet& set) {
    std::vector<std::uint32_t> rays(set.rays.size()), cell_of(set.rays.size());
    std::iota(rays.begin(), rays.end(), 0U);
    std::size_t cells = 1;
    while (cells < kMostCells && rays.size() / (2 * cells) >= kRaysOfCell) cells *= 2;
    divide(rays, places_of(set), cells, 0, cell_of);
    const Cells unit = per_flux(set);
    CellSpectra spectra{Cells(cells), Cells(cells), Cells(cells)};
    for (std::size_t i = 0; i < set.rays.size(); ++i) {
        Sampler draw(0, Purpose::acquisition, 3, i);
        const float u = draw.next();
        Cells& part = u < 0.5F ? spectra.choosing : u < 0.75F ? spectra.first : spectra.second;
        const std::uint16_t number = set.spectrum.empty() ? std::uint16_t{0} : set.spectrum[i];
        if (number != RaySet::kNoSpectrum) part[cell_of[i]] += double{set.rays[i].flux} * unit[number];
    }
    return spectra;
}

// Mixtures of k spectra: shares[c][k] of each cell.
struct Factors {
    Cells spectra;
    std::vector<std::array<double, SpectralBasis::kMost>> shares;

    double at(std::size_t c, std::size_t band) const {
        double sum = 0;
        for (std::size_t k = 0; k < spectra.size(); ++k) sum += shares[c][k] * spectra[k].at[band];
        return sum;
    }
};

// Updates shares, then spectra, once [Lee and Seung 2001, theorem 2].
void update(Factors& f, const Cells& cells) {
    const std::size_t count = f.spectra.size();
    const auto ratio = [&](std::size_t c, std::size_t band) {
        const double model = f.at(c, band);
        return model > 0 ? cells[c].at[band] / model : 0.0;
    };
    std::array<double, kBands> r;
    for (std::size_t c = 0; c < cells.size(); ++c) {
        for (std::size_t band = 0; band < kBands; ++band) r[band] = ratio(c, band);
        for (std::size_t k = 0; k < count; ++k) {
            double up = 0, down = 0;
            for (std::size_t band = 0; band < kBands; ++band)
                up += f.spectra[k].at[band] * r[band], down += f.spectra[k].at[band];
            if (down > 0) f.shares[c][k] *= up / down;
        }
    }
    Cells up(count);
    std::array<double, SpectralBasis::kMost> down{};
    for (std::size_t c = 0; c < cells.size(); ++c) {
        for (std::size_t band = 0; band < kBands; ++band) r[band] = ratio(c, band);
        for (std::size_t k = 0; k < count; ++k) {
            down[k] += f.shares[c][k];
            for (std::size_t band = 0; band < kBands; ++band) up[k].at[band] += f.shares[c][k] * r[band];
        }
    }
    for (std::size_t k = 0; k < count; ++k) {
        for (std::size_t band = 0; band < kBands && down[k] > 0; ++band)
            f.spectra[k].at[band] *= up[k].at[band] / down[k];
    }
}

// Returns the logarithm of the likelihood of counts, up to a constant.
double likelihood(const Factors& f, const Cells& cells) {
    double sum = 0;
    for (std::size_t c = 0; c < cells.size(); ++c) {
        for (std::size_t band = 0; band < kBands; ++band) {
            const double model = f.at(c, band);
            if (model > 0) sum += cells[c].at[band] * log(model) - model;
        }
    }
    return sum;
}

// Returns the mean spectrum of a fifth of the cells, those with the most of `score`.
template <typename Score>
BandSpectrum extreme(const Cells& cells, Score score) {
    std::vector<std::pair<double, std::size_t>> order;
    for (std::size_t c = 0; c < cells.size(); ++c) {
        const V3d xyz = band_xyz(cells[c]);
        if (xyz.y > 0) order.emplace_back(-score(xyz / xyz.y), c);
    }
    std::sort(order.begin(), order.end());
    BandSpectrum sum;
    for (std::size_t i = 0; i < order.size() && i <= order.size() / 5; ++i) sum += cells[order[i].second];
    return sum;
}

// Returns starts: cells of the most extreme colours.
std::vector<Cells> starts_of(const Cells& cells, std::size_t count) {
    const auto red = [](const V3d& c) { return c.x; };
    const auto blue = [](const V3d& c) { return c.z; };
    const auto green = [](const V3d& c) { return -c.x - c.z; };
    if (count == 3) return {{extreme(cells, red), extreme(cells, green), extreme(cells, blue)}};
    return {{extreme(cells, red), extreme(cells, [](const V3d& c) { return -c.x; })},
            {extreme(cells, blue), extreme(cells, [](const V3d& c) { return -c.z; })}};
}

Factors factorised(const Cells& cells, const Cells& start) {
    constexpr int kRounds = 400;
    Factors f{start, std::vector<std::array<double, SpectralBasis::kMost>>(cells.size())};
    for (std::size_t c = 0; c < cells.size(); ++c) f.shares[c].fill(1);
    for (int round = 0; round < kRounds; ++round) update(f, cells);
    return f;
}

// Takes from each spectrum as much of the others as leaves it non-negative, so that mixtures that are purer
// than any cell are still mixtures with positive shares.
void widen(Cells& spectra) {
    for (std::size_t k = 0; k < spectra.size(); ++k) {
        BandSpectrum others;
        for (std::size_t j = 0; j < spectra.size(); ++j)
            if (j != k) others += spectra[j];
        double most = 1;
        for (std::size_t band = 0; band < kBands; ++band) {
            if (others.at[band] > 0) most = std::min(most, spectra[k].at[band] / others.at[band]);
        }
        spectra[k] += -most * others;
    }
}

// Returns the best mixtures of `count` spectra; none if XYZ do not tell them apart.
std::optional<SpectralBasis> basis_of(const Cells& cells, std::size_t count) {
    Cells spectra;
    if (count == 1) {
        spectra.emplace_back();
        for (const BandSpectrum& cell : cells) spectra[0] += cell;
    } else {
        double best = -INFINITY;
        for (const Cells& start : starts_of(cells, count)) {
            Factors f = factorised(cells, start);
            const double now = likelihood(f, cells);
            if (now > best) best = now, spectra = std::move(f.spectra);
        }
        for (BandSpectrum& spectrum : spectra) {
            const double lumens = band_lumens(spectrum);
            if (!(lumens > 0)) return std::nullopt;
            spectrum *= 1 / lumens;
        }
        widen(spectra);
    }
    SpectralBasis basis;
    for (const BandSpectrum& spectrum : spectra) {
        const double lumens = band_lumens(spectrum);
        if (!(lumens > 0)) return std::nullopt;
        basis.spectra.push_back(1 / lumens * spectrum);
    }
    if (separation(basis) < kLeastSeparation) return std::nullopt;
    return basis;
}

// Returns a cell's spectrum less the mixture that its XYZ tell, in intervals of 20 nm.
std::array<double, kBands / kGroup + 1> grouped_difference(const BandSpectrum& cell,
                                                           const SpectralBasis* basis) {
    BandSpectrum rest = cell;
    if (basis != nullptr) {
        const std::vector<V3d> weights = weights_of_xyz(*basis);
        const V3d xyz = kMostLumensPerWatt * band_xyz(cell);
        for (std::size_t k = 0; k < weights.size(); ++k) rest += -weights[k].dot(xyz) * basis->spectra[k];
    }
    std::array<double, kBands / kGroup + 1> sums{};
    for (std::size_t band = 0; band < kBands; ++band) sums[band / kGroup] += rest.at[band];
    return sums;
}

struct Squared {
    double error, standard_error;
};
// Returns the squared relative error and, by the scatter of the cells, its standard error.
Squared error_of(const SpectralBasis& basis, const CellSpectra& cells) {
    RunningStats errors;
    double light = 0;
    for (std::size_t c = 0; c < cells.first.size(); ++c) {
        const auto a = grouped_difference(cells.first[c], &basis);
        const auto b = grouped_difference(cells.second[c], &basis);
        errors.add(std::inner_product(a.begin(), a.end(), b.begin(), 0.0));
        const auto one = grouped_difference(cells.first[c], nullptr);
        const auto other = grouped_difference(cells.second[c], nullptr);
        light += std::inner_product(one.begin(), one.end(), other.begin(), 0.0);
    }
    if (!(light > 0)) return {1, 0};
    const auto count = static_cast<double>(cells.first.size());
    return {errors.mean() * count / light, count > 1 ? errors.standard_error() * count / light : 0.0};
}

// Returns the spectra themselves if they are few and their colours differ.
std::optional<SpectralBasis> own_spectra(const RaySet& set) {
    const Cells unit = per_flux(set);
    std::vector<double> light(unit.size());
    for (std::size_t i = 0; i < set.rays.size(); ++i) {
        const std::uint16_t number = set.spectrum.empty() ? std::uint16_t{0} : set.spectrum[i];
        if (number != RaySet::kNoSpectrum) light[number] += double{set.rays[i].flux};
    }
    SpectralBasis basis;
    for (std::size_t n = 0; n < unit.size(); ++n) {
        const double lumens = band_lumens(unit[n]);
        if (!(light[n] * unit[n].integral() > 0)) continue;
        if (!(lumens > 0) || basis.spectra.size() == SpectralBasis::kMost) return std::nullopt;
        basis.spectra.push_back(1 / lumens * unit[n]);
    }
    if (!basis.known() || separation(basis) < kLeastSeparation) return std::nullopt;
    return basis;
}

}  // namespace

SpectralBasis spectral_basis(const RaySet& rays) {
    constexpr double kUpper = 1.645;  // of a normal value, 95 %
    if (rays.spectra.empty()) return {};
    if (const auto own = own_spectra(rays)) return *own;
    RaySet some;
    const CellSpectra cells = cell_spectra(few_of(rays, kMostRays, some));
    std::size_t best = 0;
    double least = INFINITY;
    for (std::size_t count = 1; count <= SpectralBasis::kMost; ++count) {
        const auto basis = basis_of(cells.choosing, count);
        if (!basis) continue;
        const auto [error, standard_error] = error_of(*basis, cells);
        const double bound = std::max(0.0, error) + kUpper * standard_error;
        if (bound < least) least = bound, best = count;
        if (error - kUpper * standard_error <= sqr(kWanted)) break;
    }
    if (best == 0) return {};
    SpectralBasis basis = basis_of(cells.all(), best).value_or(SpectralBasis());
    basis.error = std::sqrt(least);
    return basis;
}

}  // namespace lucerna
