// Commits the requested fault, so that a test can verify that each sanitizer and each trap stops it: a suite
// without findings proves nothing unless faults are detected. Exits with 0 if the fault was not detected.
#include <atomic>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "engine/base/parallel.h"

namespace {

// Returns the value, unknown to the compiler.
template <typename T>
T unknown(T value) {
    volatile T hidden = value;
    return hidden;
}
template <typename T>
void use(T value) {
    volatile T sink = value;
    static_cast<void>(sink);
}

void heap() {
    std::vector<int> few(4);
    int* data = few.data();
    use(data[unknown(4)]);
}
void freed() {
    auto owner = std::make_unique<int>(1);
    int* data = owner.get();
    owner.reset();
    use(*data);
}
void leak() {
    int* volatile lost = new int[unknown(100)];
    lost[0] = 1;
    lost = nullptr;
}
void overflow() {
    use(unknown(std::numeric_limits<int>::max()) + unknown(1));
}
void shift() {
    use(unknown(1) << unknown(33));
}
void cast() {
    use(static_cast<int>(unknown(1e20)));
}
void zero_divide() {
    use(unknown(1.0) / unknown(0.0));
}
void invalid() {
    use(unknown(0.0F) / unknown(0.0F));
}
void out_of_range() {
    use(unknown(1e30F) * unknown(1e30F));
}

constexpr lucerna::Workers kFour{4};
constexpr std::int64_t kChunks = 64;

// Waits until two threads are in the loop. It imposes no memory order, so the race remains one.
class Two {
  public:
    void meet() {
        arrived_.fetch_add(1, std::memory_order_relaxed);
        while (arrived_.load(std::memory_order_relaxed) < 2) std::this_thread::yield();
    }

  private:
    std::atomic<int> arrived_{0};
};

// Divides by zero in a worker thread of the loop, not in the calling thread.
void in_a_worker() {
    Two two;
    std::vector<double> shares(kChunks);
    const std::thread::id caller = std::this_thread::get_id();
    lucerna::parallel_chunks(kFour, kChunks, [&](std::int64_t chunk) {
        two.meet();
        const double divisor = std::this_thread::get_id() == caller ? 1 : 0;
        shares[static_cast<std::size_t>(chunk)] = unknown(1.0) / unknown(divisor);
    });
    use(shares[1]);
}
// All chunks add to one sum without synchronisation.
void race() {
    Two two;
    std::int64_t sum = 0;
    lucerna::parallel_chunks(kFour, kChunks, [&](std::int64_t chunk) {
        two.meet();
        sum += unknown(chunk);
    });
    use(sum);
}
// Computes the same sum from the chunks' own sums, joined in order: this is no fault.
void none() {
    std::vector<std::int64_t> sums(kChunks);
    lucerna::parallel_chunks(kFour, kChunks, [&](std::int64_t chunk) {
        for (int i = 0; i < 1000; ++i) sums[static_cast<std::size_t>(chunk)] += unknown(chunk);
    });
    std::int64_t sum = 0;
    for (const std::int64_t part : sums) sum += part;
    use(sum);
}

}  // namespace

int main(int argc, char** argv) {
    const std::map<std::string, std::function<void()>> faults{{"heap", heap},
                                                              {"freed", freed},
                                                              {"leak", leak},
                                                              {"overflow", overflow},
                                                              {"shift", shift},
                                                              {"cast", cast},
                                                              {"zero_divide", zero_divide},
                                                              {"invalid", invalid},
                                                              {"out_of_range", out_of_range},
                                                              {"in_a_worker", in_a_worker},
                                                              {"race", race},
                                                              {"none", none}};
    const auto fault = argc == 2 ? faults.find(argv[1]) : faults.end();
    if (fault == faults.end()) {
        std::fprintf(stderr, "one of these faults is accepted:");
        for (const auto& [name, commit] : faults) std::fprintf(stderr, " %s", name.c_str());
        std::fprintf(stderr, "\n");
        return 2;
    }
    const lucerna::FloatTraps traps(lucerna::kFaults);
    fault->second();
    std::printf("%s: nobody minded\n", argv[1]);
    return 0;
}
