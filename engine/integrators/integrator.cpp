#include "engine/integrators/integrator.h"

namespace lucerna {
namespace {

struct Make {
    const MapFiles& files;

    std::unique_ptr<Integrator> operator()(const PathSettings& s) const { return make_path(s); }
    std::unique_ptr<Integrator> operator()(const DirectSettings&) const { return make_direct(); }
    std::unique_ptr<Integrator> operator()(const PhotonMapSettings& s) const {
        return make_photon_mapping(s, files);
    }
    std::unique_ptr<Integrator> operator()(const IgiSettings& s) const { return make_igi(s); }
    std::unique_ptr<Integrator> operator()(const ProgressiveSettings& s) const { return make_progressive(s); }
};

}  // namespace

std::unique_ptr<Integrator> make_integrator(const IntegratorSettings& settings, const MapFiles& files) {
    return std::visit(Make{files}, settings);
}

}  // namespace lucerna
