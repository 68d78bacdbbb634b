#include "lights/spectral_lamp.h"

#include <algorithm>
#include <utility>

#include "engine/base/error.h"

namespace lucerna {
namespace {

// Returns the field of the flux weight · (X, Y, Z).
LightField weighted(const LightField& field, const V3d& weight) {
    std::vector<float> sum(field.coefficients().size());
    for (int c = 0; c < 3; ++c) {
        if (weight[c] == 0) continue;
        const LightField channel = field.channel(c);
        for (std::size_t i = 0; i < sum.size(); ++i)
            sum[i] += static_cast<float>(weight[c] * double{channel.coefficients()[i]});
    }
    LightFieldInfo info = field.info();
    info.colour = Rgb(1);
    info.spectra = {};
    return {field.rig(), sum, std::move(info)};
}

}  // namespace

std::vector<SpectralLamp> spectral_lamps(const Lumigraph& lamp) {
    std::vector<std::pair<BandSpectrum, std::vector<Slab>>> parts;
    for (const Slab& slab : lamp.slabs()) {
        const SpectralBasis& basis = slab.field.info().spectra;
        if (!basis.known()) throw InputError("the spectra of its light are not known");
        const std::vector<V3d> weights = weights_of_xyz(basis);
        for (std::size_t k = 0; k < weights.size(); ++k) {
            LightField field = weighted(slab.field, weights[k]);
            if (!(field.flux() > 0)) continue;
            auto part = std::ranges::find(parts, basis.spectra[k],
                                          &std::pair<BandSpectrum, std::vector<Slab>>::first);
            if (part == parts.end()) part = parts.insert(part, {basis.spectra[k], {}});
            part->second.push_back({slab.axes, std::move(field)});
        }
    }
    if (parts.empty()) throw InputError("it has no light");
    std::vector<SpectralLamp> lamps;
    for (auto& [spectrum, slabs] : parts) {
        if (lamp.simple())
            lamps.push_back({Lumigraph(std::move(slabs[0].field)), spectrum});
        else
            lamps.push_back({Lumigraph(std::move(slabs), lamp.box()), spectrum});
    }
    return lamps;
}

}  // namespace lucerna
