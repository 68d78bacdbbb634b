#include "photon/path_rays.h"

namespace lucerna {

std::vector<Ray> rays_of_light_paths(const Scene& scene, const MapParameters& parameters) {
    std::vector<Ray> rays;
    Ledger ledger;
    Emission emission(scene, parameters.seed, Purpose::emission, parameters.pass);
    emission.for_each(0, static_cast<std::uint64_t>(parameters.paths),
                      [&](std::uint32_t path, const std::optional<LightPathStart>& start) {
                          if (!start) return;
                          Sampler sampler =
                              Sampler::stratified(parameters.seed, Purpose::emission, parameters.pass, path);
                          SurfacePoint from = start->from;
                          const auto note = [&](const V3f& d) { rays.push_back({from.towards(d), d}); };
                          trace_light_path(
                              scene, *start, sampler, ledger,
                              [&](const LightPathHit& at) {
                                  note(at.d);
                                  from = at.hit.at;
                              },
                              [&](const LightPathScatter& at) {
                                  note(at.d);
                                  from = SurfacePoint{at.p};
                              },
                              [&](const LightPathEscape& at) { note(at.d); }, parameters.specular_below);
                      });
    return rays;
}

}  // namespace lucerna
