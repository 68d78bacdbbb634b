#include "engine/integrators/statistics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace lucerna {
namespace {

// Returns the luminance of an account.
double energy_luminance(const V3d& c) {
    return 0.212671 * c.x + 0.715160 * c.y + 0.072169 * c.z;
}

// Visits everything that is reported of a render, by name. A visitor either writes it or reads it back:
//   value(name, x)      visits a number or a note
//   group(optional, f)  lets f visit values that may be absent
template <typename Report, typename Visitor>
void visit_once(Report& once, Visitor& visitor) {
    visitor.value("emission", once.emission);
    visitor.group(once.pre_pass, [&](auto& pre_pass) {
        visitor.value("prepass.paths", pre_pass.paths);
        visitor.value("prepass.importons", pre_pass.importons);
        visitor.value("prepass.useful", pre_pass.useful);
        visitor.value("prepass.blocks", pre_pass.blocks);
        visitor.value("prepass.share_of_lights", pre_pass.share_of_lights);
    });
    visitor.group(once.guides, [&](auto& guides) {
        visitor.value("guide.photons", guides.photons);
        visitor.value("guide.records", guides.distributions);
    });
    for (std::size_t kind = 0; kind < kMapKinds; ++kind) {
        visitor.group(once.first_radius[kind], [&](auto& radius) {
            visitor.value(fmt::format("radius.first.{}", map_name(static_cast<MapKind>(kind))), radius);
        });
    }
}

template <typename Report, typename Visitor>
void visit_passes(Report& passes, Visitor& visitor) {
    visitor.group(passes.ledger, [&](auto& ledger) {
        visitor.value("energy.emitted", ledger.emitted);
        visitor.value("energy.absorbed", ledger.absorbed);
        visitor.value("energy.absorbed_by_media", ledger.absorbed_by_media);
        visitor.value("energy.scattered_by_media", ledger.scattered_by_media);
        visitor.value("energy.escaped", ledger.escaped);
        visitor.value("energy.not_followed", ledger.not_followed);
        visitor.value("energy.cut", ledger.cut);
        visitor.value("energy.roulette", ledger.roulette);
        visitor.value("energy.imbalance", ledger.imbalance);
        visitor.value("paths.emitted", ledger.paths_emitted);
        visitor.value("paths.not_emitted", ledger.paths_not_emitted);
        visitor.value("paths.hits", ledger.hits);
        visitor.value("paths.scatterings", ledger.scatterings);
    });
    for (std::size_t kind = 0; kind < kMapKinds; ++kind) {
        const std::string map(map_name(static_cast<MapKind>(kind)));
        visitor.value("map." + map, passes.map_needs[kind]);
        visitor.group(passes.maps[kind], [&](auto& photons) {
            visitor.value("photons." + map + ".stored", photons.stored);
            visitor.value("photons." + map + ".dropped.map_not_wanted", photons.not_wanted);
            visitor.value("photons." + map + ".dropped.surface_not_diffuse", photons.not_storable);
        });
    }
    visitor.value("maps", passes.map_source);
    visitor.group(passes.caustic_paths, [&](auto& paths) { visitor.value("photons.caustic.paths", paths); });
    visitor.group(passes.irradiance_points,
                  [&](auto& points) { visitor.value("irradiance.points", points); });
    visitor.group(passes.radius_share, [&](auto& share) { visitor.value("radius.share", share); });
    visitor.group(passes.vpls, [&](auto& vpls) {
        visitor.value("virtual_lights.total", vpls.total);
        visitor.value("virtual_lights.sets", vpls.sets);
        visitor.value("virtual_lights.bytes", vpls.bytes);
        visitor.group(vpls.tried, [&](auto& tried) { visitor.value("virtual_lights.tried", tried); });
    });
}

struct Writer {
    std::map<std::string, double> numbers;
    std::map<std::string, std::string> notes;

    void value(const std::string& name, double number) { numbers[name] = number; }
    void value(const std::string& name, std::uint64_t number) { numbers[name] = static_cast<double>(number); }
    void value(const std::string& name, const std::string& note) {
        if (!note.empty()) notes[name] = note;
    }
    template <typename T, typename Visit>
    void group(const std::optional<T>& optional, Visit&& visit) {
        if (optional) visit(*optional);
    }
};

struct Reader {
    const std::map<std::string, double>& numbers;
    const std::map<std::string, std::string>& notes;
    bool found = false;  // whether any value of the current group was found

    template <typename T>
    void value(const std::string& name, T& number) {
        const auto at = numbers.find(name);
        if (at == numbers.end()) return;
        number = static_cast<T>(at->second);
        found = true;
    }
    void value(const std::string& name, std::string& note) {
        if (const auto at = notes.find(name); at != notes.end()) note = at->second;
    }
    template <typename T, typename Visit>
    void group(std::optional<T>& optional, Visit&& visit) {
        const bool before = std::exchange(found, false);
        T read{};
        visit(read);
        if (found) optional = read;
        found = found || before;
    }
};

}  // namespace

void PhaseSeconds::add(const std::string& phase, double seconds) {
    const auto same = [&](const auto& entry) { return entry.first == phase; };
    const auto found = std::find_if(phases_.begin(), phases_.end(), same);
    if (found == phases_.end()) {
        phases_.emplace_back(phase, seconds);
    } else {
        found->second += seconds;
    }
}

void PhaseSeconds::add(const PhaseSeconds& other) {
    for (const auto& [phase, seconds] : other) add(phase, seconds);
}

LedgerStatistics::LedgerStatistics(const Ledger& ledger)
    : emitted(energy_luminance(ledger.emitted)),
      absorbed(energy_luminance(ledger.absorbed)),
      absorbed_by_media(energy_luminance(ledger.media)),
      scattered_by_media(energy_luminance(ledger.scattered)),
      escaped(energy_luminance(ledger.escaped)),
      not_followed(energy_luminance(ledger.not_followed)),
      cut(energy_luminance(ledger.cut)),
      roulette(energy_luminance(ledger.roulette)),
      imbalance(ledger.imbalance()),
      paths_emitted(ledger.paths - ledger.not_emitted),
      paths_not_emitted(ledger.not_emitted),
      hits(ledger.hits),
      scatterings(ledger.scatterings) {}

void report_pre_pass(const ImportancePrePass* pre_pass, std::int64_t paths, const Scene& scene,
                     OnceStatistics& statistics) {
    if (!pre_pass) {
        statistics.emission = "plain: the pre-pass saw nothing";
        return;
    }
    statistics.emission = "steered by an importance pre-pass";
    PrePassStatistics& learned = statistics.pre_pass.emplace();
    learned.paths = static_cast<std::uint64_t>(paths);
    learned.importons = pre_pass->importons;
    learned.useful = pre_pass->useful;
    learned.blocks = pre_pass->emission.blocks();
    // Half of the L1 distance is the share of paths whose light differs from the choice by power.
    double moved = 0;
    for (std::uint32_t light = 0; light < scene.lights().size(); ++light) {
        moved += std::fabs(pre_pass->emission.probability(light) - double{scene.picker().probability(light)});
    }
    learned.share_of_lights = 0.5 * moved;
    statistics.seconds.add("prepass", pre_pass->seconds);
}

void PassStatistics::add(const PassStatistics& pass) {
    PassStatistics all = pass;
    all.seconds = seconds;
    all.seconds.add(pass.seconds);
    if (ledger && all.ledger) {
        all.ledger->paths_emitted += ledger->paths_emitted;
        all.ledger->paths_not_emitted += ledger->paths_not_emitted;
        all.ledger->hits += ledger->hits;
        all.ledger->scatterings += ledger->scatterings;
    }
    for (std::size_t kind = 0; kind < kMapKinds; ++kind) {
        if (maps[kind] && all.maps[kind]) all.maps[kind]->add(*maps[kind]);
    }
    if (irradiance_points && all.irradiance_points) *all.irradiance_points += *irradiance_points;
    *this = std::move(all);
}

std::map<std::string, double> RenderReport::numbers() const {
    Writer writer;
    visit_once(once, writer);
    visit_passes(passes, writer);
    writer.value("samples.not_finite", samples_not_finite);
    writer.value("rays.invalid", rays_invalid);
    writer.value("rays.total", rays_total);
    writer.group(rays_prepare, [&](auto& rays) { writer.value("rays.prepare", rays); });
    writer.value("passes.done", static_cast<double>(passes_done));
    writer.group(relative_error, [&](auto& error) { writer.value("error.relative", error); });
    if (denoised_error && std::isfinite(*denoised_error)) writer.value("error.denoised", *denoised_error);
    writer.group(blur, [&](auto& share) { writer.value("error.blur", share); });
    if (!pixels_apart.empty()) writer.value("error.pixels_apart", static_cast<double>(pixels_apart.size()));
    return std::move(writer.numbers);
}

std::map<std::string, std::string> RenderReport::notes() const {
    Writer writer;
    visit_once(once, writer);
    visit_passes(passes, writer);
    writer.value("unit", unit);
    writer.value("energy.unit", flux_unit);
    writer.value("ended_by", ended_by);
    return std::move(writer.notes);
}

void RenderReport::restore(const std::map<std::string, double>& numbers,
                           const std::map<std::string, std::string>& notes) {
    Reader reader{numbers, notes};
    visit_once(once, reader);
    visit_passes(passes, reader);
}

void warn_of_shared(std::string_view what, Monitor& monitor) {
    monitor.warn(
        fmt::format("{} for both halves of the samples: the denoiser can neither remove nor estimate the "
                    "error that they share",
                    what));
}

void warn_of_endless_light(const Ledger& ledger, Monitor& monitor) {
    constexpr std::uint64_t kFewPaths = 64;  // fewer paths are too noisy to judge
    constexpr double kUsual = 0.5;           // usually more is absorbed or escapes, by many sigmas
    const std::uint64_t paths = ledger.paths - ledger.not_emitted;
    const double emitted = energy_luminance(ledger.emitted);
    if (paths < kFewPaths || !(emitted > 0)) return;
    const double ended =
        energy_luminance(ledger.absorbed + ledger.media + ledger.escaped + ledger.not_followed) / emitted;
    if (ended >= kUsual) return;
    monitor.warn(fmt::format(
        "{:.0f} % of the light's power was cut off after many bounces, {:.0f} on average over {} paths: "
        "surfaces and media absorb almost nothing, so the picture does not converge; in a closed room, use "
        "an albedo below 1",
        100 * std::clamp(1 - ended, 0.0, 1.0),
        static_cast<double>(ledger.hits + ledger.scatterings) / static_cast<double>(paths), paths));
}

}  // namespace lucerna
