// Writes the emission of a light field as rays, as it would be emitted for a photon map.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "lights/measured.h"
#include "lights/ray_set.h"

namespace lucerna {

class LampEmission {
  public:
    // Reads the field and its cell table. Throws InputError naming file and cause, also for a field that
    // emits nothing.
    LampEmission(const std::filesystem::path& lamp, EmissionMode mode, std::uint64_t seed,
                 const Workers& workers, Monitor& monitor);
    // As above, from a lamp in memory that is called `name` in messages and in the file.
    LampEmission(Lumigraph lamp, const std::string& name, EmissionMode mode, std::uint64_t seed,
                 const Workers& workers, Monitor& monitor);

    // Writes `rays` rays that add up to the lamp's flux. They have equal energy, except in mode `weighted`
    // and for a lamp of several colours, whose rays have the colours that renders show. Positions are on S,
    // or on the lamp's box if it has several slabs, in the frame of the lamp's file. Throws InputError if the
    // file cannot be written, or when the user stops it (no file is left behind). The result does not depend
    // on the number of threads.
    RayFileInfo write(const std::filesystem::path& file, std::uint64_t rays, Monitor& monitor) const;

    // Returns the rays of draws [begin, end) that carry flux, with their colours if the lamp has several.
    // Their sum over all draws is not yet the lamp's flux.
    RayBlock draw(std::uint64_t begin, std::uint64_t end) const;
    // Returns the total flux in the field's unit.
    double flux() const { return flux_; }

  private:
    void take(Lumigraph lamp, std::vector<CellTable> tables, const std::string& name,
              const std::string& shown, Monitor& monitor);

    bool coloured_ = false;
    EmissionMode mode_;
    std::uint64_t seed_;
    Workers workers_;
    double flux_ = 0;
    RayFileInfo info_;
    std::unique_ptr<Light> light_;
};

}  // namespace lucerna
