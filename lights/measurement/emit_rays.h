// The light of a light field as rays: what a particle map would be shot with, written down.
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
    // The same from a lamp in memory, called `name` in messages and in the file.
    LampEmission(Lumigraph lamp, const std::string& name, EmissionMode mode, std::uint64_t seed,
                 const Workers& workers, Monitor& monitor);

    // Writes `rays` rays that add up to the lamp's flux; of equal energy but in mode weighted, and of a lamp
    // of several colours, whose rays have the colours that renders see of it. Positions are on S, of
    // several slabs on the lamp's box, in the frame of the lamp's file. Throws InputError if the file cannot
    // be written, or when the user stops it (nothing is left behind). The same for any number of threads.
    RayFileInfo write(const std::filesystem::path& file, std::uint64_t rays, Monitor& monitor) const;

    // Rays by their numbers, in memory: those of draws [begin, end) that carry something; their sum over all
    // draws is not yet the lamp's flux. With their colours if the lamp has several.
    RayBlock draw(std::uint64_t begin, std::uint64_t end) const;
    // Total flux, in the field's unit.
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
