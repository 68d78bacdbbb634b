// Gives each light of a draft one spectrum, and lights with one spectrum one group.
#include <fmt/format.h>

#include <algorithm>

#include "engine/pbrt/draft.h"
#include "lights/spectral_lamp.h"

namespace lucerna {
namespace {

constexpr const char* kAccepted =
    "colours need the spectra of all lights: a light field that was imported from rays with wavelengths or "
    "spectra, or a colour as \"spectrum\" or \"blackbody\"";

Lumigraph read_lamp_of(const Draft& draft, const std::filesystem::path& file) {
    return read_lumigraph(draft.lamp_file ? draft.lamp_file(file) : file);
}

// Sets the spectrum of a lamp that is seen on a shape, which carries one light only.
void set_spectrum_on_shape(const Draft& draft, DraftLight& light) {
    const auto& area = std::get<AreaSpec>(light.spec);
    if (!area.coincident.empty())
        fail(light.place, "lights on the same surface, whose spectra are not told apart; {}", kAccepted);
    if (!area.lamp) return;
    try {
        const std::vector<SpectralLamp> parts = spectral_lamps(read_lamp_of(draft, area.lamp->file));
        if (parts.size() > 1)
            throw InputError(
                "a lamp of several spectra on a shape; expected LightSource \"lightfield\" without a shape");
        light.spectrum = parts[0].spectrum;
    } catch (const InputError& error) {
        fail(light.place, "{}: {}; {}", printable(area.lamp->file.string()), printable(error.what()),
             kAccepted);
    }
}

// Replaces light `i` by its parts: the first in its place, the others at the end. All emit the same flux, so
// that they get as many samples each, though a blue part has few lumens; the spectra have the parts' true
// shares.
void split_lamp(Draft& draft, std::size_t i, MeasuredSpec spec) {
    const Place place = draft.lights[i].place;
    const std::filesystem::path file = spec.settings.file;
    try {
        const Lumigraph lamp = read_lamp_of(draft, file);
        std::vector<SpectralLamp> parts = spectral_lamps(lamp);
        const auto count = static_cast<double>(parts.size());
        double flux = 0;
        for (const SpectralLamp& part : parts) flux += part.lamp.flux();
        for (std::size_t k = 0; k < parts.size(); ++k) {
            const double share = parts[k].lamp.flux() / flux;
            MeasuredSpec of_part = spec;
            of_part.settings.power_scale *=
                static_cast<float>(1 / count / (spec.settings.power > 0 ? 1 : share));
            of_part.part = std::make_shared<const Lumigraph>(std::move(parts[k].lamp));
            DraftLight light{.place = place, .spec = of_part, .file = file};
            light.spectrum = share * count * parts[k].spectrum;
            if (k == 0)
                draft.lights[i] = std::move(light);
            else
                draft.lights.push_back(std::move(light));
        }
    } catch (const InputError& error) {
        fail(place, "{}: {}; {}", printable(file.string()), printable(error.what()), kAccepted);
    }
}

}  // namespace

void split_by_spectra(Draft& draft, Monitor& monitor) {
    const Phase phase(monitor, "divide lamps by spectra", 0);
    const std::size_t count = draft.lights.size();
    for (std::size_t i = 0; i < count; ++i) {
        if (const auto* measured = std::get_if<MeasuredSpec>(&draft.lights[i].spec))
            split_lamp(draft, i, *measured);
        else if (std::holds_alternative<AreaSpec>(draft.lights[i].spec))
            set_spectrum_on_shape(draft, draft.lights[i]);
    }
    std::vector<BandSpectrum> spectra;
    for (DraftLight& light : draft.lights) {
        if (!light.spectrum) fail(light.place, "the spectrum of this light is not known; {}", kAccepted);
        const auto found = std::ranges::find(spectra, *light.spectrum);
        light.group = fmt::format("spectrum-{}", found - spectra.begin());
        if (found == spectra.end()) spectra.push_back(*light.spectrum);
    }
}

}  // namespace lucerna
