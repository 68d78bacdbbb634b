// The illuminance at receivers by light paths whose first bounce is specular: light of lamps over mirrors,
// lenses and solid glass, which paths from the receivers meet by chance alone (engine/render/chance_light.h).
//
// A path segment that passes a receiver at a distance below r brings its power over π r², the cross-section
// of the ball, times what the receiver reads from its direction: an estimate of the illuminance, blurred over
// the ball. Segments are counted in balls of several radii, each half of the one before. At each receiver the
// estimate is of the largest ball that agrees, within its scatter, with the ball of twice its radius. So the
// radius shrinks as more paths reveal the blur, and the blur stays below the standard error. Light over
// specular surfaces alone may have sharp edges, other light is smooth: each has a radius of its own.
//
// Emission can be learned: pilot paths, emitted plainly, tell which of them pass receivers, and paths are
// then emitted in proportion to the root of the second moment of what they add to the receivers' relative
// errors (photon/learned_emission.h). Receivers are weighted by these errors, as the greatest counts.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "engine/render/chance_light.h"
#include "engine/scene/receiver.h"
#include "photon/learned_emission.h"
#include "photon/trace_light_paths.h"

namespace lucerna {

class LightPathsAt {
  public:
    // The paths are divided into so many equal batches, whose scatter gives standard errors.
    static constexpr std::size_t kBatches = 32;
    // The number of paths of a round is this, times a power of 2.
    static constexpr std::int64_t kLeastRound = 1 << 16;

    // `radii` are those of the largest balls, in scene units, > 0; each receiver has one. `wide_radii` are
    // those within which the pilot looks for paths that come near, and are not smaller. The receivers, and
    // what the work refers to, must outlive this object.
    LightPathsAt(std::span<const Receiver> receivers, std::span<const float> radii,
                 std::span<const float> wide_radii, const ChanceLightWork& work);

    // Traces pilot paths, from which focus() learns. `others` is the illuminance at each receiver by other
    // light, relative to which errors count. Returns false if the monitor stopped it.
    bool learn(std::span<const double> others);
    // Learns the density of emission for receivers where the given relative errors, one for each receiver,
    // are large, and forgets all paths but the pilot's. May be called again, for the errors that remain.
    void focus(std::span<const double> errors);
    // Traces more paths: at most `wanted`, at least kLeastRound. Returns how many; 0 if the monitor stopped
    // it, whose paths are lost then.
    std::int64_t trace(std::int64_t wanted);
    std::int64_t paths() const { return paths_; }
    // Whether any path has passed a receiver.
    bool has_found() const { return pooled_[0].sum > 0 || pooled_[1].sum > 0; }

    struct Mean {
        ChanceLight light;
        ChanceLight seen;            // its part from lamps over specular surfaces alone
        std::vector<double> groups;  // its parts, by light group of the scene
        double blur = 0;             // bound of the error by blur
        double lasting_blur = 0;     // its part from the smallest balls, which more paths do not reduce
    };
    // Returns the mean over some receivers, at least one, of paths() > 0 paths.
    Mean mean(std::span<const std::size_t> receivers) const;

  private:
    struct Visitor;
    struct Ball {
        V3f centre;
        float radius;
    };
    class BallTree;
    // A pilot path that passes a receiver.
    struct Passage {
        std::uint32_t path, receiver;
        float brought;
    };
    struct Hits {
        double sum = 0, squares = 0;  // of what they bring
        void add(const Hits& more) {
            sum += more.sum;
            squares += more.squares;
        }
        // Returns the mean of what a hit brings, weighted by what it brings; 0 without hits.
        double each() const { return sum > 0 ? squares / sum : 0.0; }
        template <typename Archive>
        void fields(Archive& archive) {
            archive(sum, squares);
        }
    };
    struct Level {
        int level = 0;
        double blur = 0, least_error = 0;
    };

    bool run(LightPathRequest& paths, bool is_pilot, std::vector<Visitor>& chunks) const;
    void learn_emission();
    void choose_levels();
    // Returns the mean over paths of a batch's estimate by balls of a level, for one receiver.
    double estimate(std::size_t batch, std::size_t receiver, std::size_t part, int level) const;

    std::span<const Receiver> receivers_;
    ChanceLightWork work_;
    std::size_t parts_;  // of each receiver: one of chains and one of other paths, for each light group
    struct Balls {
        std::vector<Ball> balls;
        std::shared_ptr<const BallTree> tree;
    };
    Balls balls_, wide_balls_;
    std::optional<LearnedEmission> emission_;
    std::int64_t first_ = 0, paths_ = 0, pilot_paths_ = 0;
    std::vector<Passage> passages_;
    std::vector<double> weights_;               // of each receiver's squared error
    std::vector<std::vector<double>> batches_;  // sums of rings, [receiver][part][ring]
    std::vector<Hits> hits_;                    // [receiver][chains, other paths]
    std::vector<bool> was_hit_;                 // by paths that focus() forgot
    std::array<Hits, 2> pooled_;                // of all receivers: chains, other paths
    std::vector<Level> levels_;                 // [receiver][chains, other paths]
};

}  // namespace lucerna
