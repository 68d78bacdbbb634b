#include "engine/photometry/maintenance.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/base/error.h"
#include "engine/text/plain_text.h"
#include "engine/text/units.h"

namespace lucerna {
namespace {

double parse_factor(const Location& at, std::string_view word) {
    const double factor = parse_number(at, word, 0, 1);
    if (!(factor > 0)) input_error(at, "{} is not a maintenance factor; expected above 0, at most 1", word);
    return factor;
}

// Multiplies the light of one point or of a mean.
class Maintained {
  public:
    Maintained(double all, std::vector<double> groups) : all_(all), groups_(std::move(groups)) {
        greatest_ = all;
        for (const double group : groups_) greatest_ = std::max(greatest_, group);
    }
    // Multiplies the groups' light, and returns the factor of all of it together.
    double apply(std::vector<double>& groups, double all) const {
        double sum = all_ * all;
        for (std::size_t g = 0; g < groups.size(); ++g) {
            sum += (groups_[g] - all_) * groups[g];
            groups[g] *= groups_[g];
        }
        return all > 0 ? sum / all : 1.0;
    }
    void apply(Reading95& reading, double factor) const {
        reading.value *= factor;
        reading.half_width *= greatest_;
    }

  private:
    double all_, greatest_;
    std::vector<double> groups_;  // of each light group of the scene
};

}  // namespace

void parse_maintenance(const Location& at, std::string_view word, MaintenanceFactors& factors) {
    const std::size_t equals = word.rfind('=');
    if (equals == word.npos)
        factors.all = parse_factor(at, word);
    else
        factors.groups.emplace_back(word.substr(0, equals), parse_factor(at, word.substr(equals + 1)));
}

void maintain(IlluminanceReport& report, const MaintenanceFactors& factors) {
    std::vector<double> groups(report.groups.size(), factors.all);
    for (const auto& [name, factor] : factors.groups) {
        const auto found = std::ranges::find(report.groups, name);
        if (found == report.groups.end()) {
            input_error({"--maintenance-factor"}, "the scene has no light group \"{}\"; it has {}",
                        one_line(name),
                        report.groups.empty() ? "none" : fmt::format("{}", fmt::join(report.groups, ", ")));
        }
        groups[static_cast<std::size_t>(found - report.groups.begin())] = factor;
    }
    const Maintained maintained(factors.all, groups);
    for (SurfaceIlluminance& surface : report.surfaces) {
        for (PointIlluminance& point : surface.points) {
            if (point.is_cut_off()) continue;
            const double factor = maintained.apply(point.groups, point.all.value);
            maintained.apply(point.all, factor);
            maintained.apply(point.indirect, factor);
            point.direct *= factor;
            point.mirrored *= factor;
        }
        // The interval of the mean may be wider than that of independent points.
        Reading95 mean = surface.mean;
        maintained.apply(mean, 1);
        sum_up(surface);
        surface.mean.half_width = mean.half_width;
    }
}

}  // namespace lucerna
