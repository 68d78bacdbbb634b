#include "photon/path_rays.h"

namespace lucerna {

std::vector<Ray> rays_of_light_paths(const Scene& scene, const MapPlan& plan) {
    std::vector<Ray> rays;
    Ledger ledger;
    Emission emission(scene, plan.seed, Purpose::emission, plan.pass);
    emission.for_each(0, static_cast<std::uint64_t>(plan.paths),
                      [&](std::uint32_t path, const std::optional<LightPathStart>& start) {
                          if (!start) return;
                          Stream stream = Stream::stratified(plan.seed, Purpose::emission, plan.pass, path);
                          SurfacePoint from = start->from;
                          const auto note = [&](const V3f& d) { rays.push_back({from.towards(d), d}); };
                          walk(
                              scene, *start, stream, ledger,
                              [&](const WalkHit& at) {
                                  note(at.d);
                                  from = at.hit.at;
                              },
                              [&](const WalkScatter& at) {
                                  note(at.d);
                                  from = SurfacePoint{at.p};
                              },
                              [&](const WalkExit& at) { note(at.d); }, plan.specular_below);
                      });
    return rays;
}

}  // namespace lucerna
