// A command on the ranks of a parallel job (engine/ranks/ranks.h). Rank 0 reads, prints and writes like a
// single process; the others read the scene, too, and share the work.
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
    // Joins the job if the launcher started more than one rank. Throws InputError.
    ParallelJob(const CommandContext& context, const Workers& workers);

    Ranks* ranks() const { return ranks_.get(); }  // null for a single process
    bool leads() const { return !ranks_ || ranks_->leads(); }

    // Runs `act`. An error on any rank is reported once, with rank and host unless it is rank 0, and ends all
    // ranks.
    void run(const std::function<void()>& act) const;

  private:
    const CommandContext& context_;
    std::unique_ptr<Ranks> ranks_;
};

// Tells whether this process has work to do, before a command joins the job. For help and for commands (the
// words of the command line) that do not share work, rank 0 does everything.
bool has_work_here(std::span<const char* const> words);
// Reports on `err`, at rank 0, that it works alone.
void say_if_alone(std::span<const char* const> words, std::ostream& err);
// Waits a few seconds, so that rank 0 reports an error of all ranks and ends them first.
void leave_it_to_rank_0();

// The functions below are collective and make the ranks agree.

// Requires the same facts of the work and of the program on every rank. Otherwise rank 0 throws InputError
// that names the first rank, and its host, whose program, files or settings differ, the difference, and what
// the rank `would` do, e.g. "render another picture". The others wait to be ended.
void require_same_facts(Ranks& ranks, std::string_view would, Facts facts);
// Distributes the settings of rank 0.
void share_settings(Ranks& ranks, IntegratorSettings& settings);

}  // namespace lucerna
