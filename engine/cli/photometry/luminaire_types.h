// The kinds of luminaire in a scene, for a report.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/scene/scene.h"
#include "lights/measurement/plane_irradiance.h"
#include "lights/photometric.h"

namespace lucerna {

// Lights of one kind, file and flux.
struct LuminaireType {
    std::string kind, file;  // as LuminairePlace has them
    std::size_t count = 0;
    double flux = 0;         // of each, in the scene's unit
    V3d size{0, 0, 0};       // of the bounds of the first [m]
    std::string polar;       // an SVG element; empty for lights without a file
    Beam beam;               // of the file, with the flux above
    double kelvin = 0;       // colour temperature of all its light; 0: none, or no colour is known
    double watts = 0;        // each, as the file states; 0: not stated
    std::string provenance;  // of a photometric file
};

// Returns the types in the order of the scene's lights. Reads the lamps' files, and throws as that does.
std::vector<LuminaireType> luminaire_types(const Scene& scene, const Workers& workers, Monitor& monitor);

// Returns the far field of a light field or of a ray file.
PhotometricWeb far_field_of(const std::filesystem::path& file, const FarFieldGrid& grid,
                            const Workers& workers, Monitor& monitor);

}  // namespace lucerna
