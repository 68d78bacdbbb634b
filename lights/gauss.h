// Gauss-Legendre rules on [0, 1], which are exact for polynomials up to degree 2n - 1.
#pragma once

#include <array>
#include <span>

namespace lucerna {

struct GaussNode {
    double x, weight;  // the weights of a rule add up to 1
};

inline constexpr int kMaxGauss = 5;

// Returns the rule with n nodes, n clamped to [1, kMaxGauss].
inline std::span<const GaussNode> gauss_rule(int n) {
    static constexpr std::array<GaussNode, 1> kOne{{{0.5, 1.0}}};
    static constexpr std::array<GaussNode, 2> kTwo{
        {{0.21132486540518711775, 0.5}, {0.78867513459481288225, 0.5}}};
    static constexpr std::array<GaussNode, 3> kThree{
        {{0.11270166537925831148, 5.0 / 18.0}, {0.5, 8.0 / 18.0}, {0.88729833462074168852, 5.0 / 18.0}}};
    static constexpr std::array<GaussNode, 4> kFour{{{0.06943184420297371239, 0.17392742256872692869},
                                                     {0.33000947820757186760, 0.32607257743127307131},
                                                     {0.66999052179242813240, 0.32607257743127307131},
                                                     {0.93056815579702628761, 0.17392742256872692869}}};
    static constexpr std::array<GaussNode, 5> kFive{{{0.04691007703066800360, 0.11846344252809454376},
                                                     {0.23076534494715845448, 0.23931433524968323402},
                                                     {0.5, 0.28444444444444444444},
                                                     {0.76923465505284154552, 0.23931433524968323402},
                                                     {0.95308992296933199640, 0.11846344252809454376}}};
    switch (n) {
        case 1:
            return kOne;
        case 2:
            return kTwo;
        case 3:
            return kThree;
        case 4:
            return kFour;
        default:
            return n < 1 ? std::span<const GaussNode>(kOne) : std::span<const GaussNode>(kFive);
    }
}

}  // namespace lucerna
