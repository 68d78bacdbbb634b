// Particles of a measured light field, many at a time.
//
// A particle is a cell drawn from the table, a point of its interval of S, a point of its pixel of M, and the
// line through both. Particles are made in blocks that stay in the first cache, and every stage is a loop
// over a block: reads of the table and of the field overlap, and the arithmetic is done for many particles in
// one instruction. A particle does not depend on the block it is made in.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "lights/cell_table.h"
#include "lights/light.h"
#include "lights/light_field.h"
#include "lights/placement.h"

namespace lucerna {

// How a particle is placed within its cell [Goesele 2003, 5.1, appendix B].
enum class EmissionMode : std::uint8_t { constant, exact, weighted };

class CellEmission {
  public:
    struct Settings {
        EmissionMode mode;
        double flux;   // of all that leaves [the field's unit], > 0 if anything is to be emitted
        double gain;   // the same over the clamped field's
        float extent;  // of S, scene units
    };
    // Keeps references to all three.
    CellEmission(const LightField& field, const CellTable& table, const Placement& placement,
                 const Settings& settings);

    // The spans have the same size. Requires flux > 0. No sample: `weighted` met a place where h is clamped.
    void sample_Le_many(std::span<const LeSampleU> u, std::span<std::optional<LeSample>> out) const;

  private:
    struct Lanes;
    void fetch_members(Lanes& lanes, std::size_t size) const;
    void place_exactly(Lanes& lanes, std::span<const LeSampleU> u) const;
    void weigh(Lanes& lanes, std::size_t size) const;
    void place(Lanes& lanes, std::size_t size) const;
    void emit_block(std::span<const LeSampleU> u, std::span<std::optional<LeSample>> out) const;

    const LightField& field_;
    const CellTable& table_;
    const Placement& placement_;
    Settings settings_;
    V3f normal_;
};

}  // namespace lucerna
