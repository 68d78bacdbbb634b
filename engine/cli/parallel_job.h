// Runs a command on the ranks of a parallel job (engine/ranks/ranks.h): all ranks read the scene and share
// the work; rank 0 prints and writes what one process would.
#pragma once

#include <functional>
#include <memory>
#include <ostream>
#include <span>
#include <string_view>

#include "engine/base/monitor.h"
#include "engine/cli/commands.h"
#include "engine/integrators/settings.h"
#include "engine/ranks/ranks.h"
#include "engine/text/facts.h"

namespace lucerna {

class ParallelJob {
  public:
    // Joins the job, if the launcher has started more than one rank. Throws InputError.
    ParallelJob(const CommandContext& context, const Workers& workers);

    Ranks* ranks() const { return ranks_.get(); }  // null for a single process
    bool leads() const { return !ranks_ || ranks_->leads(); }

    // Reports an error that any rank throws once, with the rank and its host if it is not rank 0, and ends
    // all ranks.
    void run(const std::function<void()>& act) const;

  private:
    const CommandContext& context_;
    std::unique_ptr<Ranks> ranks_;
};

// Returns whether this rank has something to do, before a command joins the job. Commands that share no work
// among ranks, as their words say, and help are run by rank 0 alone.
bool has_work_here(std::span<const char* const> words);
// Warns on `err` of a command that rank 0 runs alone.
void say_if_alone(std::span<const char* const> words, std::ostream& err);
// Waits so that rank 0 reports an error that all ranks have, and ends this one.
void leave_it_to_rank_0();

// Compares the facts of the work, and the program, of all ranks. If they differ, rank 0 throws InputError
// that names the first such rank, its host, the difference, and what the rank `would` do, such as "render
// another picture", while the other ranks wait to be ended. Collective.
void require_same_facts(Ranks& ranks, std::string_view would, Facts facts);
// Copies rank 0's settings to all ranks. Collective.
void share_settings(Ranks& ranks, IntegratorSettings& settings);

}  // namespace lucerna
