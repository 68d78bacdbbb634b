#include "engine/cli/photometry/lux_replicates.h"

#include <fmt/format.h>

#include <string>

#include "engine/base/error.h"
#include "lights/measurement/ray_bootstrap.h"

namespace lucerna {
namespace {

// Reports the phases of a replicate, but not the reader's warnings, which were already reported for the lamps
// themselves.
class ReplicateMonitor final : public Monitor {
  public:
    ReplicateMonitor(Monitor& monitor, int replicate, int count)
        : monitor_(monitor), prefix_(fmt::format("replicate {} of {}: ", replicate, count)) {}
    void begin(std::string_view phase, std::uint64_t total) override {
        monitor_.begin(prefix_ + std::string(phase), total);
    }
    void advance(std::uint64_t units) override { monitor_.advance(units); }
    void end() override { monitor_.end(); }
    bool stopped() const override { return monitor_.stopped(); }

  private:
    Monitor& monitor_;
    std::string prefix_;
};

}  // namespace

int replicates_of(const std::set<std::filesystem::path>& lamps, const std::string& scene, CommandFiles& files,
                  Monitor& monitor) {
    if (lamps.empty()) {
        throw InputError({scene},
                         "has no measured lamp; --replicates computes the uncertainty of light fields that "
                         "lucerna light import has made of ray files");
    }
    const std::filesystem::path* fewest = nullptr;
    int count = 0;
    bool differ = false;
    for (const std::filesystem::path& lamp : lamps) {
        const int of_lamp = count_replicates(lamp);
        if (of_lamp < kLeastReplicates) {
            input_error({lamp.string()},
                        "{} bootstrap replicates beside it, at least {} are needed; make them by lucerna "
                        "light import RAYS -o {} --replicates 20",
                        of_lamp, kLeastReplicates, lamp.filename().string());
        }
        for (int b = 1; b <= of_lamp; ++b) files.reads(replicate_file(lamp, b));
        differ = differ || (fewest != nullptr && of_lamp != count);
        if (fewest == nullptr || of_lamp < count) fewest = &lamp, count = of_lamp;
    }
    if (differ) {
        monitor.warn(fmt::format("lamps have different numbers of replicates; as many are used as {} has, {}",
                                 fewest->string(), count));
    }
    return count;
}

std::vector<IlluminanceReport> by_replicates(const PhotometryOptions& common,
                                             std::span<const CalculationSurface> surfaces,
                                             const IlluminanceReport& whole, IlluminanceOptions options,
                                             int count, RunTimes& times, Monitor& monitor) {
    const std::uint64_t seed = options.seed;
    options.most_samples = whole.samples;
    constexpr int kLeastSamples = 2;  // fewer are not worth reading the scene again
    const double least = kLeastSamples * whole.seconds / whole.samples;
    std::vector<IlluminanceReport> reports;
    for (int b = 1; b <= count && !monitor.stopped(); ++b) {
        if (!(times.left() > 0)) break;
        ReplicateMonitor of_replicate(monitor, b, count);
        PhotometryOptions by_replicate = common;
        by_replicate.overrides.lamp_file = [b](const std::filesystem::path& lamp) {
            return replicate_file(lamp, b);
        };
        CommandFiles same;  // the files of the first reading
        Job job = by_replicate.read(options.workers, same, of_replicate);
        options.seconds = times.by_replicate(least);
        options.seed = seed ^ (0x9e3779b97f4a7c15U * static_cast<std::uint64_t>(b + 1));
        try {
            IlluminanceReport report = illuminance_on(surfaces, std::move(job), options, of_replicate);
            if (report.ended_by == "user") break;
            reports.push_back(std::move(report));
        } catch (const Stopped&) {
            break;  // no sample was completed in time
        }
    }
    return reports;
}

}  // namespace lucerna
