#include "engine/cli/parallel_job.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <string_view>
#include <thread>

#include "engine/base/error.h"
#include "engine/cli/run.h"
#include "engine/system/files.h"
#include "engine/system/hash.h"

namespace lucerna {
namespace {

// Tells two builds of one version apart.
std::string hash_of_program() {
    WordHash hash;
    hash.add_bytes(read_bytes("/proc/self/exe"));
    return fmt::format("{:016x}", hash.value());
}

bool shares_work(std::span<const char* const> words) {
    constexpr std::string_view kCommands[][2] = {{"render"}, {"study"}, {"light", "acquire"}};
    return std::ranges::any_of(kCommands, [&](const auto& command) {
        return !words.empty() && words[0] == command[0] &&
               (command[1].empty() || (words.size() > 1 && words[1] == command[1]));
    });
}

bool asks_for_help(std::span<const char* const> words) {
    return std::ranges::any_of(
        words, [](std::string_view word) { return word == "--help" || word == "-h" || word == "--version"; });
}

}  // namespace

ParallelJob::ParallelJob(const CommandContext& context, const Workers& workers) : context_(context) {
    if (is_parallel_job()) ranks_ = std::make_unique<Ranks>(join_parallel_job(), workers.threads);
}

void ParallelJob::run(const std::function<void()>& act) const {
    if (!ranks_) return act();
    try {
        act();
    } catch (const Stopped&) {  // All ranks throw it.
        if (leads()) throw;
    } catch (...) {
        std::string who = "lucerna";
        if (!ranks_->leads()) {
            leave_it_to_rank_0();
            who += fmt::format(": rank {} on {}", ranks_->rank(), ranks_->host(ranks_->rank()));
        }
        const int code = report_error(context_.err, context_.process, who);
        context_.err.flush();
        ranks_->abort(code);
    }
}

bool has_work_here(std::span<const char* const> words) {
    return rank_by_launcher() == 0 || (shares_work(words) && !asks_for_help(words));
}

void say_if_alone(std::span<const char* const> words, std::ostream& err) {
    if (!is_parallel_job() || shares_work(words) || asks_for_help(words)) return;
    err << "lucerna: warning: this command runs on rank 0 only; render, light acquire and study share their "
           "work among ranks\n";
}

void leave_it_to_rank_0() {
    std::this_thread::sleep_for(std::chrono::seconds(3));
}

void require_same_facts(Ranks& ranks, std::string_view would, Facts facts) {
    facts.insert(facts.begin(), {"program (hash of its file)", hash_of_program()});
    std::vector<std::string> lines;
    for (const auto& [name, value] : facts) lines.push_back(name), lines.push_back(value);
    Packer own;
    own(lines);
    const auto all = ranks.gather("facts", own.take());
    for (std::size_t r = 1; r < all.size(); ++r) {
        std::vector<std::string> others;
        Unpacker unpacker(all[r]);
        unpacker(others);
        Facts there;
        for (std::size_t i = 0; i + 1 < others.size(); i += 2) there.emplace_back(others[i], others[i + 1]);
        if (const auto difference = first_difference(there, facts)) {
            throw InputError(
                fmt::format("rank {} on {} would {}: its {} is {}, that of rank 0 on {} is {}; use the same "
                            "program, files and options on all ranks",
                            r, ranks.host(static_cast<int>(r)), would, difference->name, difference->of_first,
                            ranks.host(0), difference->of_second));
        }
    }
    ranks.agree(true);  // If the facts differ, rank 0 ends all ranks before it gets here.
}

void share_settings(Ranks& ranks, IntegratorSettings& settings) {
    Packer packer;
    std::visit([&](const auto& own) { packer(std::string(integrator_name(settings)), own); }, settings);
    const std::vector<std::byte> bytes = ranks.broadcast("settings", packer.take());
    std::string name;
    Unpacker unpacker(bytes);
    unpacker(name);
    settings = make_settings(name, {});
    std::visit([&](auto& own) { unpacker(own); }, settings);
}

}  // namespace lucerna
