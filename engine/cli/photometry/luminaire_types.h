// The kinds of luminaire in a scene, for a report.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/photometry/illuminance.h"
#include "engine/scene/scene.h"
#include "engine/text/facts.h"
#include "lights/measurement/plane_irradiance.h"
#include "lights/photometric.h"

namespace lucerna {

// Lights of one kind, file and flux.
struct LuminaireType {
    std::string kind, file;  // as LuminairePlace has them
    std::size_t count = 0;
    double flux = 0;    // of each, in the scene's unit
    double watts = 0;   // of each, as the file states; 0: not stated
    std::string polar;  // an SVG element; empty for lights without a file
    // The lines of its data sheet: article, photometry, size.
    Facts facts;
};

struct Luminaires {
    std::vector<LuminairePlace> places;
    std::vector<LuminaireType> types;  // in the order of the places
    std::vector<std::size_t> type_of;  // index of the type of each place
};

// Finds the types of luminaires of the scene. Reads the lamps' files, and throws as that does.
Luminaires with_types(std::vector<LuminairePlace> places, const Scene& scene, const Workers& workers,
                      Monitor& monitor);

// Returns the far field of a light field or of a ray file.
PhotometricWeb far_field_of(const std::filesystem::path& file, const FarFieldGrid& grid,
                            const Workers& workers, Monitor& monitor);

}  // namespace lucerna
