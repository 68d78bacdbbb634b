// Shared by the figures of measured lamps: counts particles of a lamp on planes in front of it and compares
// them with the true irradiance.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <ctime>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/sampler.h"
#include "lights/cell_table.h"
#include "lights/emission_net.h"
#include "lights/light_field.h"
#include "lights/measured.h"
#include "lights/measurement/plane_irradiance.h"

namespace lucerna {

inline constexpr std::array<std::pair<EmissionMode, std::string_view>, 2> kEmissionModes{
    {{EmissionMode::constant, "constant"}, {EmissionMode::exact, "exact"}}};

// Returns the CPU time of this process, because others may use the machine.
inline double cpu_seconds() {
    return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

// Returns the root mean square difference relative to that of the truth, which is not black.
inline double relative_rms(std::span<const double> values, std::span<const double> truth) {
    double square = 0, whole = 0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
        square += (values[i] - truth[i]) * (values[i] - truth[i]);
        whole += truth[i] * truth[i];
    }
    return std::sqrt(square / whole);
}

// Returns the lamp with negative coefficients set to 0, so that particles and project() agree exactly.
inline LightField without_negative(const LightField& field) {
    std::vector<float> e(field.coefficients().begin(), field.coefficients().end());
    for (float& x : e) x = std::max(x, 0.0F);
    return {field.rig(), e, field.info()};
}

struct PlaneErrors {
    double bias2 = 0;        // relative to the truth's mean square; about 0, of either sign, without bias
    double bias2_error = 0;  // standard error of bias2 if the noise of pixels is independent
    double noise2 = 0;       // of one batch, relative in the same way
};

struct EmissionMeasured {
    double particles_per_second = 0;  // on one thread, for complete particles written to memory
    std::vector<PlaneErrors> planes;
};

struct Particles {
    std::uint32_t batches = 16;
    std::uint32_t in_batch = 1U << 18;  // a power of 2, for which the net is uniform
};

// Counts particles where they hit the planes.
class PlaneCounts {
  public:
    explicit PlaneCounts(std::span<const PlaneIrradiance> truths) : truths_(truths) {
        for (const PlaneIrradiance& truth : truths) {
            now_.emplace_back(truth.values.size());
            sum_.emplace_back(truth.values.size());
            square_.emplace_back(truth.values.size());
        }
    }

    void add(const LeSample& particle) {
        for (std::size_t i = 0; i < truths_.size(); ++i) {
            const PlanePatch& patch = truths_[i].patch;
            // d.z > 0, because light leaves a lamp towards +z.
            const double t = (patch.distance - double{particle.from.p.z}) / static_cast<double>(particle.d.z);
            const double x = double{particle.from.p.x} + t * double{particle.d.x} - patch.centre.x;
            const double y = double{particle.from.p.y} + t * double{particle.d.y} - patch.centre.y;
            const double column = std::floor((x / patch.size.x + 0.5) * patch.pixels.x);
            const double row = std::floor((y / patch.size.y + 0.5) * patch.pixels.y);
            if (!(column >= 0 && column < patch.pixels.x && row >= 0 && row < patch.pixels.y)) continue;
            const auto pixel = static_cast<std::size_t>(row) * static_cast<std::size_t>(patch.pixels.x) +
                               static_cast<std::size_t>(column);
            now_[i][pixel] += double{luminance(particle.weight)};
        }
    }

    // Ends a batch of `count` particles, whether they were counted or lost.
    void end_batch(std::uint32_t count) {
        for (std::size_t i = 0; i < truths_.size(); ++i) {
            for (std::size_t p = 0; p < now_[i].size(); ++p) {
                const double e = now_[i][p] / (count * truths_[i].patch.pixel_area());
                sum_[i][p] += e;
                square_[i][p] += e * e;
                now_[i][p] = 0;
            }
        }
        ++batches_;
    }

    // Returns the errors from two or more batches.
    std::vector<PlaneErrors> errors() const {
        std::vector<PlaneErrors> all;
        const double batches = batches_;
        for (std::size_t i = 0; i < truths_.size(); ++i) {
            double whole = 0, off = 0, noise2 = 0, spread2 = 0;
            for (std::size_t p = 0; p < sum_[i].size(); ++p) {
                const double mean = sum_[i][p] / batches, truth = truths_[i].values[p];
                const double variance = (square_[i][p] / batches - mean * mean) * batches / (batches - 1);
                whole += truth * truth;
                off += (mean - truth) * (mean - truth) - variance / batches;
                noise2 += variance;
                spread2 += 2 * variance * variance / (batches * batches);
            }
            all.push_back({off / whole, std::sqrt(spread2) / whole, noise2 / whole});
        }
        return all;
    }

  private:
    std::span<const PlaneIrradiance> truths_;
    std::vector<std::vector<double>> now_, sum_, square_;
    std::uint32_t batches_ = 0;
};

// Emits and counts particles on one thread.
inline EmissionMeasured measure_emission(const Light& light, std::span<const PlaneIrradiance> truths,
                                         const Particles& particles) {
    constexpr std::uint32_t kChunk = 512;
    PlaneCounts counts(truths);
    std::vector<LeSampleU> u(kChunk);
    std::vector<std::optional<LeSample>> out(kChunk);
    double seconds = 0;
    for (std::uint32_t batch = 0; batch < particles.batches; ++batch) {
        const EmissionNet net(1, Purpose::bench, batch);
        // in_batch is a multiple of a chunk.
        for (std::uint32_t first = 0; first < particles.in_batch; first += kChunk) {
            for (std::uint32_t i = 0; i < kChunk; ++i) u[i] = net.at(first + i).u;
            const double begin = cpu_seconds();
            light.sample_Le_many(u, out);
            seconds += cpu_seconds() - begin;
            for (const auto& particle : out) {
                if (particle) counts.add(*particle);
            }
        }
        counts.end_batch(particles.in_batch);
    }
    return {static_cast<double>(particles.batches) * particles.in_batch / seconds, counts.errors()};
}

}  // namespace lucerna
