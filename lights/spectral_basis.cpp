#include "lights/spectral_basis.h"

#include <algorithm>

#include "engine/base/elementary.h"

namespace lucerna {
namespace {

// Returns XYZ of the spectrum, with Y = 1.
V3d unit_xyz(const BandSpectrum& spectrum) {
    const V3d xyz = band_xyz(spectrum);
    return xyz / xyz.y;
}

}  // namespace

std::vector<V3d> weights_of_xyz(const SpectralBasis& basis) {
    const std::vector<BandSpectrum>& spectra = basis.spectra;
    if (spectra.size() == 1) return {V3d(0, 1, 0)};
    const V3d a = unit_xyz(spectra[0]), b = unit_xyz(spectra[1]);
    if (spectra.size() == 2) {
        // The share t of the second one minimises (X - (1 - t) a_X - t b_X)² and the same of Z.
        const V3d across(b.x - a.x, 0, b.z - a.z);
        const V3d second = (across - V3d(0, across.dot(a), 0)) / across.length2();
        return {V3d(0, 1, 0) - second, second};
    }
    // Rows of the inverse of the matrix whose columns are the colours.
    const V3d c = unit_xyz(spectra[2]);
    const double determinant = a.dot(b.cross(c));
    return {b.cross(c) / determinant, c.cross(a) / determinant, a.cross(b) / determinant};
}

double separation(const SpectralBasis& basis) {
    std::vector<V3d> colours;
    for (const BandSpectrum& spectrum : basis.spectra) {
        const V3d xyz = unit_xyz(spectrum);
        colours.push_back(V3d(xyz.x, 0, xyz.z));
    }
    if (colours.size() < 2) return 1;
    double least = 1;
    for (std::size_t i = 0; i < colours.size(); ++i) {
        const V3d &from = colours[(i + 1) % colours.size()], to = colours[i] - from;
        double distance = to.length();
        if (colours.size() == 3) {
            const V3d line = colours[(i + 2) % 3] - from;
            distance = line.length() > 0 ? std::abs(to.x * line.z - to.z * line.x) / line.length() : 0;
        }
        least = std::min(least, distance / colours[i].length());
    }
    return least;
}

}  // namespace lucerna
