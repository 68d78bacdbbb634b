// A command on the ranks of a parallel job (engine/ranks/ranks.h): rank 0 reads, says and writes what one
// process would; the others read the scene, too, and share the work.
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
    // Joins the job, if the launcher started more than one rank. Throws InputError.
    ParallelJob(const CommandContext& context, const Workers& workers);

    Ranks* ranks() const { return ranks_.get(); }  // null: this process is alone
    bool leads() const { return !ranks_ || ranks_->leads(); }

    // An error that any rank throws is told once, with the rank and its host where it is not rank 0, and ends
    // them all.
    void run(const std::function<void()>& act) const;

  private:
    const CommandContext& context_;
    std::unique_ptr<Ranks> ranks_;
};

// Before a command joins the job. Of one that shares no work among ranks (the words of its command line), and
// of help, rank 0 does what a process alone would, and the others have nothing to do.
bool has_work_here(std::span<const char* const> words);
// Rank 0 says on `err` that it does so.
void say_if_alone(std::span<const char* const> words, std::ostream& err);
// Lets rank 0 tell what is wrong on all ranks: it then ends before this one.
void leave_it_to_rank_0();

// The ranks agree. Collective.

// Of the work, and of this program, on every rank: rank 0 throws InputError that names the first rank, and
// its host, whose program, files or settings differ, and in what: it would e.g. "render another picture". The
// others wait there to be ended.
void require_same_facts(Ranks& ranks, std::string_view would, Facts facts);
// Rank 0's.
void share_settings(Ranks& ranks, IntegratorSettings& settings);

}  // namespace lucerna
