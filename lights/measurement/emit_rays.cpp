#include "lights/measurement/emit_rays.h"

#include <cmath>
#include <optional>

#include "engine/base/error.h"
#include "engine/base/monitor.h"
#include "engine/base/sampler.h"

namespace lucerna {
namespace {

constexpr std::uint64_t kDrawsPerChunk = 1 << 14;  // draws per chunk
constexpr std::uint64_t kBatch = 64;               // chunks in memory at once

MeasuredSettings settings_of(const std::string& name, EmissionMode mode) {
    MeasuredSettings settings;
    settings.file = name;
    settings.mode = mode;
    return settings;
}

// Returns a particle's numbers in the order in which the photon maps draw them. Past 2³² draws the stratified
// sequence restarts with another key.
LeSampleU numbers(std::uint64_t seed, std::uint64_t draw) {
    Sampler sampler =
        Sampler::stratified(seed, Purpose::emission, draw >> 32, static_cast<std::uint32_t>(draw));
    LeSampleU u;
    u.position = sampler.next2();
    u.direction = sampler.next2();
    u.salt = sampler.bits();
    return u;
}

}  // namespace

LampEmission::LampEmission(Lumigraph lamp, const std::string& name, EmissionMode mode, std::uint64_t seed,
                           const Workers& workers, Monitor& monitor)
    : mode_(mode), seed_(seed), workers_(workers) {
    std::vector<CellTable> tables;
    for (const LightField* field : fields_of(lamp)) tables.emplace_back(*field, workers, monitor);
    take(std::move(lamp), std::move(tables), name, name, monitor);
}

LampEmission::LampEmission(const std::filesystem::path& file, EmissionMode mode, std::uint64_t seed,
                           const Workers& workers, Monitor& monitor)
    : mode_(mode), seed_(seed), workers_(workers) {
    Lumigraph lamp = read_lumigraph(file);
    std::vector<CellTable> tables = load_or_build_cell_tables(file, fields_of(lamp), workers, monitor);
    take(std::move(lamp), std::move(tables), file.string(), file.filename().string(), monitor);
}

void LampEmission::take(Lumigraph lamp, std::vector<CellTable> tables, const std::string& name,
                        const std::string& shown, Monitor& monitor) {
    coloured_ = lamp.coloured();
    info_.unit = lamp.unit();
    info_.xyz = lamp.xyz();
    info_.lumens_per_watt = lamp.lumens_per_watt();
    info_.colour_per_ray = coloured_;
    info_.text = fmt::format("lucerna light field {}; {}", shown, lamp.provenance());
    light_ = make_measured_light(std::move(lamp), std::move(tables), settings_of(name, mode_), monitor,
                                 nullptr, workers_);
    flux_ = light_->power();
    if (!(flux_ > 0)) throw InputError({name}, "the light field emits nothing");
}

RayBlock LampEmission::draw(std::uint64_t begin, std::uint64_t end) const {
    std::vector<LeSampleU> u;
    u.reserve(end - begin);
    for (std::uint64_t i = begin; i < end; ++i) u.push_back(numbers(seed_, i));
    std::vector<std::optional<LeSample>> emitted(u.size());
    light_->sample_Le_many(u, emitted);
    RayBlock block;
    block.rays.reserve(u.size());
    for (const std::optional<LeSample>& particle : emitted) {
        if (!particle) continue;
        const float flux = luminance(particle->weight);
        if (!(flux > 0)) continue;
        block.rays.push_back({particle->from.p, particle->d, flux});
        if (coloured_) block.tristimulus.emplace_back(rgb_to_xyz(particle->weight / flux));
    }
    return block;
}

namespace {

// Gives the first `rays` rays of a lamp, batch by batch.
class Batches {
  public:
    Batches(const LampEmission& lamp, std::uint64_t rays, const Workers& workers, Monitor& monitor)
        : lamp_(lamp), left_(rays), workers_(workers), monitor_(monitor) {}

    std::uint64_t left() const { return left_; }
    void next(RayBlock& batch) {
        batch = {};
        while (batch.rays.empty() && left_ > 0) {
            if (monitor_.stopped()) throw Stopped("stopped; no ray file was written");
            // A draw makes at most one ray, so no more chunks are needed.
            const std::uint64_t count = std::min(kBatch, (left_ + kDrawsPerChunk - 1) / kDrawsPerChunk);
            std::vector<RayBlock> chunks(count);
            parallel_chunks(workers_, static_cast<std::int64_t>(count), [&](std::int64_t chunk) {
                const std::uint64_t begin = drawn_ + static_cast<std::uint64_t>(chunk) * kDrawsPerChunk;
                chunks[static_cast<std::size_t>(chunk)] = lamp_.draw(begin, begin + kDrawsPerChunk);
            });
            drawn_ += count * kDrawsPerChunk;
            for (const RayBlock& chunk : chunks) {
                batch.rays.insert(batch.rays.end(), chunk.rays.begin(), chunk.rays.end());
                batch.tristimulus.insert(batch.tristimulus.end(), chunk.tristimulus.begin(),
                                         chunk.tristimulus.end());
            }
            if (batch.rays.size() > left_) batch.rays.resize(left_);
            if (batch.tristimulus.size() > left_) batch.tristimulus.resize(left_);
        }
        left_ -= batch.rays.size();
    }

  private:
    const LampEmission& lamp_;
    std::uint64_t left_, drawn_ = 0;
    Workers workers_;
    Monitor& monitor_;
};

}  // namespace

RayFileInfo LampEmission::write(const std::filesystem::path& file, std::uint64_t rays,
                                Monitor& monitor) const {
    RayFileInfo info = info_;
    info.rays = rays;
    info.flux = flux_;
    if (!keeps_colour(file, info)) {
        monitor.warn(
            fmt::format("{}: the lamp's colour is not saved; TM-25 files can hold it, in lumens or with a "
                        "known luminous efficacy, and SPEOS files that of a single wavelength",
                        file.string()));
    }
    // Rays of unequal energy are drawn twice: once for the sum that the second time makes the lamp's flux.
    double factor = 0;
    RayBlock batch;
    if (coloured_) {
        Phase phase(monitor, "weighing rays", rays);
        double sum = 0;
        for (Batches batches(*this, rays, workers_, monitor); batches.left() > 0;) {
            batches.next(batch);
            for (const LampRay& ray : batch.rays) sum += double{ray.flux};
            phase.advance(batch.rays.size());
        }
        factor = flux_ / sum;  // > 0, because every ray counted carries flux
    }
    Phase phase(monitor, "writing rays", rays);
    Batches batches(*this, rays, workers_, monitor);
    const auto equal = static_cast<float>(flux_ / static_cast<double>(rays));
    write_rays(file, info, [&](RayBlock& block) {
        batches.next(block);
        for (LampRay& ray : block.rays)
            ray.flux = coloured_ ? static_cast<float>(factor * double{ray.flux}) : equal;
        phase.advance(block.rays.size());
    });
    return info;
}

}  // namespace lucerna
