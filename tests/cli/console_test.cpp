#include "engine/cli/console.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <csignal>

#include <sstream>

#include "engine/base/parallel.h"

namespace lucerna {
namespace console_test {

using ::testing::HasSubstr;

// A console whose clock the test sets.
struct Console {
    explicit Console(bool terminal = false, bool quiet = false) {
        settings.terminal = terminal;
        settings.quiet = quiet;
        settings.stop = &stop;
        settings.seconds = [this] { return now; };
    }
    std::ostringstream out, err;
    double now = 100;
    std::atomic<int> stop{0};
    ConsoleSettings settings;
};

TEST(Console, PlainShortPhase_SaysBeginningAndEndOnly) {
    Console c;
    ConsoleMonitor monitor(c.out, c.err, c.settings);
    {
        Phase phase(monitor, "photons", 100);
        for (int i = 0; i < 100; ++i) {
            c.now += 0.02;
            phase.advance(1);
        }
    }
    EXPECT_EQ(c.out.str(), "photons …\nphotons: 2 s\n");
    EXPECT_EQ(c.err.str(), "");
}

TEST(Console, PlainLongPhase_SaysEveryTenthAfterFiveSeconds) {
    Console c;
    ConsoleMonitor monitor(c.out, c.err, c.settings);
    {
        Phase phase(monitor, "image", 100);
        for (int i = 0; i < 100; ++i) {
            c.now += 0.2;  // 20 s in all; at 25 % 5 s have elapsed
            phase.advance(1);
        }
    }
    EXPECT_EQ(c.out.str(),
              "image …\nimage: 20 %, about 15 s left\nimage: 30 %, about 14 s left\n"
              "image: 40 %, about 12 s left\nimage: 50 %, about 10 s left\nimage: 60 %, about 8 s left\n"
              "image: 70 %, about 6 s left\nimage: 80 %, about 4 s left\nimage: 90 %, about 2 s left\nimage: "
              "20 s\n");
}

TEST(Console, CutShort_SaysHowFarItCame) {
    Console c;
    ConsoleMonitor monitor(c.out, c.err, c.settings);
    {
        Phase phase(monitor, "image", 200);
        phase.advance(50);
    }
    EXPECT_THAT(c.out.str(), HasSubstr("ended at 25 %"));
}

TEST(Console, Terminal_RedrawsAtMostTenTimesASecond) {
    Console c(true);
    ConsoleMonitor monitor(c.out, c.err, c.settings);
    {
        Phase phase(monitor, "image", 10'000);
        for (int i = 0; i < 10'000; ++i) {
            c.now += 0.0002;  // 2 s
            phase.advance(1);
        }
    }
    const std::string text = c.err.str();
    EXPECT_LE(std::count(text.begin(), text.end(), '\r'), 1 + 20 + 1);  // begin, 2 s of drawing, clearing
    EXPECT_GE(std::count(text.begin(), text.end(), '\r'), 15);
    EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1);
    EXPECT_THAT(text, HasSubstr("[###############...............]  50 %  1 s left"));
    EXPECT_EQ(c.out.str(), "");
}

TEST(Console, NestedPhases_OuterCountGoesOn) {
    Console c;
    ConsoleMonitor monitor(c.out, c.err, c.settings);
    {
        Phase outer(monitor, "scene", 10);
        outer.advance(4);
        {
            Phase inner(monitor, "table", 3);
            inner.advance(3);
        }
        outer.advance(6);
    }
    EXPECT_EQ(c.out.str(),
              "scene …\ntable …\ntable: <0.01 s\nscene: <0.01 s\n");  // neither phase prints "ended at"
}

TEST(Console, RepeatedWarning_IsSaidOnceAndCounted) {
    Console c;
    {
        ConsoleMonitor monitor(c.out, c.err, c.settings);
        for (int i = 0; i < 5; ++i) monitor.warn("no\nnormals");
        monitor.warn("other");
        EXPECT_EQ(monitor.warnings(), 6U);
    }
    EXPECT_EQ(c.err.str(),
              "lucerna: warning: no normals\nlucerna: warning: other\n"
              "lucerna: warning: 4 more times: no normals\n");
}

TEST(Console, Quiet_SaysWarningsOnly) {
    Console c(true, true);
    {
        ConsoleMonitor monitor(c.out, c.err, c.settings);
        Phase phase(monitor, "image", 2);
        phase.advance(1);
        c.now += 10;
        phase.advance(1);
        monitor.info("a line");
        monitor.warn("a warning");
    }
    EXPECT_EQ(c.out.str(), "");
    EXPECT_EQ(c.err.str(), "lucerna: warning: a warning\n");
}

TEST(Console, AdvanceFromManyThreads_LosesNothing) {
    Console c;
    c.settings.seconds = {};
    ConsoleMonitor monitor(c.out, c.err, c.settings);
    {
        Phase phase(monitor, "image", 200'000);
        parallel_chunks(Workers{4}, 200, [&](std::int64_t) {
            for (int i = 0; i < 1000; ++i) phase.advance(1);
        });
    }
    EXPECT_THAT(c.out.str(), ::testing::Not(HasSubstr("ended at")));
}

TEST(Console, StopFlag_IsSeen) {
    Console c;
    const ConsoleMonitor monitor(c.out, c.err, c.settings);
    EXPECT_FALSE(monitor.stopped());
    c.stop = SIGINT;
    EXPECT_TRUE(monitor.stopped());
    EXPECT_FALSE(ConsoleMonitor(c.out, c.err, {}).stopped());
}

}  // namespace console_test
}  // namespace lucerna
