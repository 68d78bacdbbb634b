#include "engine/cli/study/study_runs.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <numeric>
#include <utility>

#include "engine/base/error.h"
#include "engine/base/monitor.h"
#include "engine/cli/command_files.h"
#include "engine/cli/commands.h"
#include "engine/cli/parallel_job.h"
#include "engine/cli/render/checkpointing.h"
#include "engine/cli/render/render_request.h"
#include "engine/cli/render/run_report.h"
#include "engine/render/render.h"
#include "engine/system/files.h"
#include "engine/system/hash.h"

namespace lucerna {
namespace {

// Tells whether the image keeps the light of visible lamps, which identifies their pixels.
bool keeps_lamps(const StudyWork& work) {
    return work.is_reference && work.scene->mask_lamps;
}

std::string name_of(const Job& job, const StudyWork& work) {
    WordHash hash;
    for (const auto& [name, value] : picture_facts(job, work.seed)) {
        hash.add(std::string_view(name));
        hash.add(std::string_view(value));
    }
    hash.add(job.spp);
    if (work.point->seconds > 0) hash.add(work.point->seconds);
    return fmt::format("{:016x}", hash.value());
}

// Tells whether name_of() could give this name to a render or to its notes.
bool is_run(const std::string& file) {
    const std::filesystem::path name(file);
    const std::string hash = name.stem().string();
    return (name.extension() == ".exr" || name.extension() == ".json") && hash.size() == 16 &&
           hash.find_first_not_of("0123456789abcdef") == hash.npos;
}

// Reads notes, which are written last, so that their image is complete.
std::optional<StudyRun> noted(const std::filesystem::path& notes, const std::filesystem::path& image) {
    std::error_code status;
    if (!std::filesystem::exists(notes, status) || !std::filesystem::exists(image, status)) return {};
    std::ifstream in = open_to_read(notes);
    try {
        const nlohmann::json json = nlohmann::json::parse(in);
        return StudyRun{image,
                        json.at("seconds").at("total").get<double>(),
                        true,
                        json.value("machine", ""),
                        json.value("date", ""),
                        json.at("threads").get<int>(),
                        json.value("host", "")};
    } catch (const nlohmann::json::exception&) {
        throw InputError({notes.string()}, "was not written by a study; remove it to have it rendered again");
    }
}

// Returns the render's statistics with its machine and date.
std::string notes_text(const std::string& statistics, const Ranks* ranks) {
    auto json = nlohmann::ordered_json::parse(statistics);
    json["machine"] = machine_text();
    if (ranks) json["host"] = ranks->host(ranks->rank());
    json["date"] = today_text();
    return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

// The monitor of a render on another rank than 0: rank 0 ends the loop over renders where its user asks to
// stop, and prints the warnings.
class DistantMonitor final : public Monitor {
  public:
    explicit DistantMonitor(Ranks& ranks) : ranks_(ranks) {}
    void warn(std::string_view line) override { warnings_.emplace_back(line); }
    bool stopped() const override { return ranks_.has_ended(); }
    std::vector<std::string> take_warnings() { return std::exchange(warnings_, {}); }

  private:
    Ranks& ranks_;
    std::vector<std::string> warnings_;
};

// If the ranks of a host have more threads than it has processors, they wait for each other, and their times
// include that.
void warn_of_crowded_hosts(Ranks& ranks, Monitor& monitor) {
    Packer packer;
    packer(static_cast<int>(sysconf(_SC_NPROCESSORS_ONLN)));
    const auto all = ranks.gather("processors", packer.take());
    std::map<std::string, int> threads, processors;
    for (std::size_t r = 0; r < all.size(); ++r) {
        const int rank = static_cast<int>(r);
        Unpacker unpacker(all[r]);
        unpacker(processors[ranks.host(rank)]);
        threads[ranks.host(rank)] += ranks.threads(rank);
    }
    for (const auto& [host, count] : threads) {
        if (count <= processors[host]) continue;
        monitor.warn(
            fmt::format("the ranks on {} have {} threads in total for {} processors, so their times will be "
                        "too long; use fewer --threads or ranks",
                        host, count, processors[host]));
    }
}

}  // namespace

void StudyRuns::check(std::span<const StudyWork> all, Monitor& monitor) {
    for (const StudyWork& work : all) {
        if (!work.is_reference) continue;
        try {
            read(work, monitor);
        } catch (const InputError& error) {
            throw InputError(work.scene->place, fmt::format("\"file\": {}", error.what()));
        }
    }
}

StudyRuns::StudyRuns(std::filesystem::path folder, const Command& command)
    : folder_(std::move(folder)), command_(command) {
    if (command_.ranks && !command_.ranks->leads()) return;
    std::error_code status;
    std::filesystem::create_directories(folder_, status);
    if (status) throw InputError({folder_.string()}, "cannot be created: " + status.message());
    command_.files.writes_into(folder_, "study", is_run);
}

Job StudyRuns::read(const StudyWork& work, Monitor& monitor) {
    SceneOverrides overrides = work.point->overrides;
    overrides.resolution = work.scene->resolution;
    overrides.strict = command_.strict;
    overrides.unit = command_.unit;
    Job job = read_scene(work.scene->file, overrides, command_.workers, monitor);
    if (scenes_.insert(work.scene->file).second) {
        command_.files.reads(job.files);
        command_.files.reads(job.caches);
    }
    return job;
}

std::optional<StudyRuns::Made> StudyRuns::make(const StudyWork& work, Monitor& monitor,
                                               std::optional<StopOnSignals>& listening) {
    RunFacts facts{work.scene->file, work.seed, command_.workers.threads, 0, 0, 0};
    const Stopwatch reading;
    Job job = read(work, monitor);
    facts.read_seconds = reading.seconds();
    Made made;
    RenderOptions options{work.seed, command_.workers};
    if (work.point->seconds > 0) {
        // The limit includes the time of reading, as the measured time does.
        options.limits.seconds = work.point->seconds - facts.read_seconds;
        apply({}, options.limits, job);
    }
    if (keeps_lamps(work)) job.film.parts = true;
    made.name = name_of(job, work);
    const std::filesystem::path image = image_of(made.name);
    if (command_.ranks ? kept_.contains(made.name) : noted(notes_of(made.name), image).has_value())
        return made;

    if (!listening) listening.emplace(command_.process);
    const Stopwatch rendering;
    RenderResult result = render(job, options, monitor);
    facts.render_seconds = rendering.seconds();
    if (!result.report.complete || monitor.stopped()) return {};
    result.image.attributes.merge(header_attributes(facts, job, result.report));
    if (keeps_lamps(work)) {
        add_channels(result.image,
                     with_channels(result.parts.value(),
                                   [](const std::string& name) {
                                       return std::ranges::find(kLampChannels, name) !=
                                              std::ranges::end(kLampChannels);
                                   }),
                     "");
    }
    made.image = exr_bytes(result.image);
    made.notes = notes_text(statistics_json(facts, job, result.report, image), command_.ranks);
    return made;
}

StudyRun StudyRuns::keep(const Made& made) const {
    const std::filesystem::path image = image_of(made.name), notes = notes_of(made.name);
    const bool found = made.image.empty();
    if (!found) {
        const std::span<const std::byte> whole(made.image);
        replace_file(image, std::span(&whole, 1));
        write_text(notes, made.notes);
    }
    std::optional<StudyRun> run = noted(notes, image);
    if (!run) throw InputError({image.string()}, "was removed after it was written");
    run->found = found;
    return *run;
}

std::optional<StudyRun> StudyRuns::run(const StudyWork& work, Monitor& monitor) {
    std::optional<StopOnSignals> listening;
    const std::optional<Made> made = make(work, monitor, listening);
    if (!made) return {};
    return keep(*made);
}

void StudyRuns::find_kept() {
    std::vector<std::string> names;
    if (command_.ranks->leads()) {
        for (const auto& entry : std::filesystem::directory_iterator(folder_)) {
            const std::string name = entry.path().stem().string();
            if (entry.path().extension() == ".json" && is_run(entry.path().filename().string()) &&
                noted(entry.path(), image_of(name)))
                names.push_back(name);
        }
    }
    Packer packer;
    packer(names);
    const std::vector<std::byte> bytes = command_.ranks->broadcast("renders found", packer.take());
    Unpacker unpacker(bytes);
    unpacker(names);
    kept_ = {names.begin(), names.end()};
}

std::vector<std::optional<StudyRun>> StudyRuns::run_by_ranks(std::span<const StudyWork> all, Monitor& monitor,
                                                             const WhenMade& when_made) {
    Ranks& ranks = *command_.ranks;
    warn_of_crowded_hosts(ranks, monitor);
    DistantMonitor distant(ranks);
    Monitor& own = ranks.leads() ? monitor : distant;
    std::set<const StudyScene*> seen;
    for (const StudyWork& work : all) {
        if (!seen.insert(work.scene).second) continue;
        require_same_facts(ranks, "render a different picture", picture_facts(read(work, own), work.seed));
    }
    find_kept();
    std::optional<StopOnSignals> listening(std::in_place, command_.process);  // only rank 0 acts on a signal
    ranks.listen_to([&monitor] { return monitor.stopped(); });

    std::mutex mutex;
    std::vector<std::optional<StudyRun>> runs(ranks.leads() ? all.size() : 0);
    const auto receive_result = [&](std::int64_t item, int rank, const Made& made) {
        const std::lock_guard lock(mutex);
        for (const std::string& line : made.warnings) monitor.warn(line);
        const auto i = static_cast<std::size_t>(item);
        runs[i] = keep(made);
        when_made(all[i], *runs[i], rank);
    };
    Made last;  // of this rank
    Ranks::Loop loop;
    loop.shared.resize(all.size());
    std::iota(loop.shared.begin(), loop.shared.end(), std::int64_t{0});
    loop.ends = [&ranks] { return ranks.asked_to_stop(); };
    loop.made = [&last](std::int64_t) {
        Packer packer;
        packer(last);
        return packer.take();
    };
    loop.arrived = [&receive_result](std::int64_t item, int rank, std::span<const std::byte> bytes) {
        Made made;
        Unpacker unpacker(bytes);
        unpacker(made);
        receive_result(item, rank, made);
    };
    // Each rank makes one render at a time, with all its threads.
    ranks.work({1}, loop, [&](std::int64_t item) {
        std::optional<Made> made = make(all[static_cast<std::size_t>(item)], own, listening);
        if (!made) return false;
        made->warnings = distant.take_warnings();
        last = std::move(*made);
        if (ranks.leads()) receive_result(item, 0, last);
        return true;
    });
    return runs;
}

}  // namespace lucerna
