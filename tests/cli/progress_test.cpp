// Progress: how many lines a log gets, and what they predict. The clock is simulated.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "tools/common/progress.hpp"

namespace nif::test {
namespace {

using tools::ProgressPace, tools::TimeLeft;
using Reader = ProgressPace::Reader;

/// Updates a thousand times a second.
int shown(Reader reader, double seconds, const std::function<double(double)>& fraction) {
  ProgressPace pace(reader);
  int count = 0;
  for (int i = 0; i < seconds * 1000; ++i) count += pace.due(i / 1000.0, fraction(i / 1000.0));
  return count;
}

TEST(Progress, ALogGetsALineForEachTenthAtMost) {
  const auto steady = [](double seconds) { return [seconds](double now) { return now / seconds; }; };
  EXPECT_EQ(shown(Reader::log, 3600, steady(3600)), 10);
  EXPECT_EQ(shown(Reader::log, 5, steady(5)), 4);  // one a second, the first after one
  EXPECT_EQ(shown(Reader::log, 0.9, steady(0.9)), 0);
  // A stage that stalls, one that goes backwards, one that jumps.
  EXPECT_EQ(shown(Reader::log, 600, [](double) { return 0.03; }), 1);
  EXPECT_EQ(shown(Reader::log, 600, [](double now) { return 0.5 + 0.4 * std::sin(now); }), 2);
  EXPECT_EQ(shown(Reader::log, 600, [](double now) { return now < 300 ? 0.2 : 1.0; }), 2);
}

TEST(Progress, ProgramsAndTerminalsGetTenASecond) {
  const auto still = [](double) { return 0.03; };
  EXPECT_NEAR(shown(Reader::program, 11, still), 100, 2);
  EXPECT_EQ(shown(Reader::program, 0.9, still), 0);
  EXPECT_NEAR(shown(Reader::terminal, 10, still), 100, 2);
}

TEST(TimeLeft, IsEstimatedFromProgress) {
  TimeLeft left;
  EXPECT_EQ(left.text(1, 0.01), "");
  EXPECT_EQ(left.text(10, 0.1), "1:30 min left");
  EXPECT_EQ(left.text(50, 0.5), "50 s left");
  EXPECT_EQ(left.text(60, 0.75), "20 s left");
  EXPECT_EQ(left.text(80, 1), "0 s left");
  EXPECT_EQ(TimeLeft().text(3600, 0.1), "9:00 h left");
}

TEST(TimeLeft, NeverGrowsWhileAStageTakesLonger) {
  TimeLeft left;
  EXPECT_EQ(left.text(50, 0.5), "50 s left");
  EXPECT_EQ(left.text(60, 0.5), "40 s left");
  EXPECT_EQ(left.text(90, 0.53), "10 s left");
  EXPECT_EQ(left.text(100, 0.53), "0 s left");
  EXPECT_EQ(left.text(101, 0.53), "takes longer");
  EXPECT_EQ(left.text(1000, 0.59), "takes longer");
  // Another tenth is done, at another speed.
  EXPECT_EQ(left.text(1200, 0.6), "13:20 min left");
  EXPECT_EQ(left.text(1210, 0.6), "13:10 min left");
  // A shorter remaining time shows immediately.
  EXPECT_EQ(left.text(1211, 0.9), "2:15 min left");
}

TEST(TimeLeft, HasTheWidthThatProgramsExpect) {
  for (const double seconds : {0.1, 59.0, 61.0, 3599.0, 3601.0, 99.0 * 3600}) {
    TimeLeft left;
    EXPECT_LT(left.text(seconds, 0.5).size(), 15u);
    EXPECT_LT(left.text(3 * seconds + 1, 0.5).size(), 15u);
  }
}

}  // namespace
}  // namespace nif::test
