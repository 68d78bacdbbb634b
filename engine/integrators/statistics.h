// Holds what a method reports about its work, beside the image: what it made once, and in its passes.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/guiding/importance_pre_pass.h"
#include "engine/ranks/ranks.h"
#include "photon/build_maps.h"
#include "photon/deposit.h"
#include "photon/ledger.h"

namespace lucerna {

// Holds the seconds of each phase, in order.
class PhaseSeconds {
  public:
    void add(const std::string& phase, double seconds);
    void add(const PhaseSeconds& other);
    auto begin() const { return phases_.begin(); }
    auto end() const { return phases_.end(); }

  private:
    std::vector<std::pair<std::string, double>> phases_;
};

// Holds the energy ledger of light paths: the luminance of each account, W (or lm).
//
// `emitted` is the lamps' flux if emission is plain and all particles of a lamp carry the same power. A
// learned density (photon/learned_emission.h) weights particles, so that `emitted` is then an estimate of the
// flux.
struct LedgerStatistics {
    double emitted = 0, absorbed = 0, absorbed_by_media = 0, scattered_by_media = 0, escaped = 0;
    double not_followed = 0, cut = 0, roulette = 0;
    double imbalance = 0;  // |emitted - all ends| / emitted, of the worst channel
    std::uint64_t paths_emitted = 0, paths_not_emitted = 0, hits = 0, scatterings = 0;

    LedgerStatistics() = default;
    explicit LedgerStatistics(const Ledger& ledger);
    std::uint64_t paths() const { return paths_emitted + paths_not_emitted; }
};

// Reports the importance pre-pass (engine/guiding/importance_pre_pass.h).
struct PrePassStatistics {
    std::uint64_t paths = 0, importons = 0, blocks = 0;
    double useful = 0;           // share of its paths that contributed to what the camera sees
    double share_of_lights = 0;  // share of light paths that power alone would start from other lights
};

// Reports the photons that guide shadow rays (engine/guiding/guide.h).
struct GuideStatistics {
    std::uint64_t photons = 0, distributions = 0;
};

struct VplStatistics {
    std::uint64_t total = 0, sets = 0, bytes = 0;
    std::optional<std::uint64_t> tried;  // before thinning, if they were thinned
};

// Reports what all passes share, made before the first.
struct OnceStatistics {
    std::string emission;  // how light paths are emitted, and why; empty: not reported
    std::optional<PrePassStatistics> pre_pass;
    std::optional<GuideStatistics> guides;
    std::array<std::optional<double>, kMapKinds> first_radius;  // progressive: the mean, scene units
    PhaseSeconds seconds;
};

// Records what an importance pre-pass learned, or (null) that it saw nothing.
void report_pre_pass(const ImportancePrePass* pre_pass, std::int64_t paths, const Scene& scene,
                     OnceStatistics& statistics);

// The phase of the pilot that finds how many samples of each kind pixels take. It takes as long with any
// number of photons.
inline constexpr std::string_view kPilotPhase = "pilot";

// Reports what one pass made, or all of them.
struct PassStatistics {
    std::optional<LedgerStatistics> ledger;  // paths and hits of all passes, energies of the last
    std::array<std::optional<DepositCount>, kMapKinds> maps;  // photons of all passes
    std::array<std::string, kMapKinds> map_needs;             // whether each map was built, and why
    std::string map_source;                                   // empty: the maps were built
    std::optional<std::uint64_t> caustic_paths;               // light paths of igi's Caustic map
    std::optional<std::uint64_t> irradiance_points;
    std::optional<double> radius_share;  // progressive: the radius relative to the first
    std::optional<VplStatistics> vpls;
    PhaseSeconds seconds;

    // Adds a pass. Seconds and counts add up; everything else becomes the last pass's.
    void add(const PassStatistics& pass);
};

// Reports what one rank of a parallel job did.
struct RankReport {
    std::string host;
    int threads = 1;
    std::uint64_t tiles = 0;  // rendered by this rank, summed over the rounds
    std::uint64_t rays = 0;
    double prepare_seconds = 0, image_seconds = 0;
    double prepare_processor_seconds = 0, image_processor_seconds = 0;  // of all its threads
    std::uint64_t peak_memory = 0;                                      // bytes

    template <typename Archive>
    void fields(Archive& archive) {
        archive(host, threads, tiles, rays, prepare_seconds, image_seconds, prepare_processor_seconds,
                image_processor_seconds, peak_memory);
    }
};

// Reports what a render did, for --stats.
struct RenderReport {
    OnceStatistics once;
    PassStatistics passes;
    PhaseSeconds seconds;  // of the render itself

    std::string unit;        // of the image
    std::string flux_unit;   // of the energies
    std::string ended_by;    // "samples", "time", "error", "user"
    int samples_done = 0;    // per pixel
    double whole_after = 0;  // s from the beginning until each pixel had a sample; 0: not
    int passes_done = 0;     // of an integrator that works in passes
    bool complete = true;    // false: stopped early by the user
    std::uint64_t samples_not_finite = 0;
    std::uint64_t rays_total = 0, rays_invalid = 0;
    std::optional<std::uint64_t> rays_prepare;  // traced before the first ray of the image
    std::optional<double> relative_error;       // estimated, of the image
    std::optional<double> denoised_error;       // of the denoised image, its blur included
    std::optional<double> blur;                 // of both images, due to density estimates (BlurMeter)
    std::vector<V2i> pixels_apart;              // left out of relative_error (Film::ErrorEstimate)
    std::vector<RankReport> ranks;              // of a parallel job
    std::map<std::string, Ranks::Traffic, std::less<>> traffic;  // of rank 0 of a parallel job

    // These return values by dotted names, which are stable: the JSON's keys.
    std::map<std::string, double> numbers() const;
    std::map<std::string, std::string> notes() const;
    // Restores what the passes before a checkpoint reported.
    void restore(const std::map<std::string, double>& numbers,
                 const std::map<std::string, std::string>& notes);
};

// Warns if most of the light's power is cut off by Russian roulette or the length limit, as in a closed room
// of albedo 1: that power is missing, and what rare long paths contribute has no bound.
void warn_of_endless_light(const Ledger& ledger, Monitor& monitor);

// Warns that `what` serves both halves of the samples (RenderContext), which should share nothing.
void warn_of_shared(std::string_view what, Monitor& monitor);

}  // namespace lucerna
