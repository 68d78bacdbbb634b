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
// Where a surface scatters a path otherwise, not by a delta lobe, and is not near a receiver, the light that
// it sends there needs no density estimate: it is computed by a shadow ray, as from a virtual point light
// [Keller 1997]. Each such place is connected to a few of the receivers. Segments from there to a receiver
// do not count in balls, except in media, where places are not connected.
//
// Emission can be learned: pilot paths tell which of them pass receivers, and paths are then emitted in
// proportion to the root of the second moment of what they add to the receivers' relative errors
// (photon/learned_emission.h). Receivers are weighted by these errors, as the greatest counts. The first
// pilot paths are emitted plainly. If few of them pass receivers, more are emitted by a density that is
// learned from the first bounces of still more paths, since most miss specular surfaces that are small beside
// what the lamps light, and then by the densities that all pilots so far have taught.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "engine/guiding/importance_pre_pass.h"
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

    // Distances around a receiver, in scene units, > 0.
    struct Reach {
        float radius;       // of the largest ball
        float wide_radius;  // within which the pilot looks for paths that come near, not smaller
        float near;         // closer places are not connected, as their light would scatter too much
    };
    // Each receiver has a reach. The receivers, and what the work refers to, must outlive this object.
    LightPathsAt(std::span<const Receiver> receivers, std::span<const Reach> reaches,
                 const ChanceLightWork& work);

    // Traces pilot paths, from which focus() learns, and forgets all others if they have taught a density
    // already. `others` is the illuminance at each receiver by other light, relative to which errors count.
    // Returns false if the monitor stopped it.
    bool learn(std::span<const double> others);
    // Learns the density of emission for receivers where the given relative errors, one for each receiver,
    // are large, and forgets all paths but the pilots'. May be called again, for the errors that remain, and
    // traces another pilot if few paths have passed these receivers. Returns false if the monitor stopped it.
    bool focus(std::span<const double> errors);
    // Traces more paths: at most `wanted`, at least kLeastRound. Returns how many; 0 if the monitor stopped
    // it, whose paths are lost then.
    std::int64_t trace(std::int64_t wanted);
    std::int64_t paths() const { return paths_; }
    // Whether any path has ever passed a receiver.
    bool has_found() const {
        return std::ranges::any_of(pooled_, [](const Hits& of_kind) { return of_kind.sum > 0; }) ||
               std::ranges::any_of(earlier_, [](double of_hit) { return of_hit > 0; });
    }

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
    // Kinds of light: of chains of specular surfaces alone, of other paths by balls, and of connections.
    static constexpr std::size_t kKinds = 3;
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

    bool pilot(std::int64_t paths, std::shared_ptr<const LearnedEmission> emission);
    bool learn_first_bounces();
    void forget();
    bool has_learned() const;
    bool run(LightPathRequest& paths, bool is_pilot, std::vector<Visitor>& chunks) const;
    double learn_emission();
    void choose_levels();
    // Returns the mean over paths of a batch's estimate by balls of a level, for one receiver.
    double estimate(std::size_t batch, std::size_t receiver, std::size_t part, int level) const;

    std::span<const Receiver> receivers_;
    ChanceLightWork work_;
    std::size_t parts_;  // of each receiver: one of each kind, for each light group
    struct Balls {
        std::vector<Ball> balls;
        std::shared_ptr<const BallTree> tree;
    };
    Balls balls_, wide_balls_;
    std::shared_ptr<const LearnedEmission> emission_;  // null: plain
    std::vector<PilotPaths> pilots_;
    std::int64_t first_ = 0, paths_ = 0, pilot_paths_ = 0;  // pilot_paths_: of all pilots
    std::vector<Passage> passages_;
    std::vector<double> weights_;               // of each receiver's squared error
    std::vector<std::vector<double>> batches_;  // sums of rings, [receiver][part][ring]
    std::vector<Hits> hits_;                    // [receiver][kind]
    std::vector<bool> was_hit_;                 // by paths that focus() forgot
    std::array<Hits, kKinds> pooled_;           // of all receivers
    std::array<double, kKinds> earlier_{};      // what each hit brought before focus()
    std::vector<Level> levels_;                 // [receiver][kind]
    std::vector<float> near_;                   // Reach::near of each receiver
};

}  // namespace lucerna
