// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <monitoring/alarm_settings.hpp>
#include <set>
#include <string>
#include <type_traits>

namespace resonid::monitoring {
namespace {

std::string fault_of(const AxisAlarmSettings& settings) {
  const auto fine = check(settings);
  return fine ? "" : fine.error().field.str() + " " + fine.error().requirement.str();
}

TEST(AlarmSettings, DefaultsPass) { EXPECT_EQ(fault_of({}), ""); }

TEST(AlarmSettings, FaultsAreNamed) {
  AxisAlarmSettings s;
  s[Watched::stiffness].low = 10.0;
  s[Watched::stiffness].high = 10.0;
  EXPECT_EQ(fault_of(s), "stiffness.low must be below high");
  s[Watched::stiffness].high = 11.0;
  s[Watched::stiffness].deadband = 1.0;
  EXPECT_EQ(fault_of(s), "stiffness.deadband must be below half the distance of high and low");
  s[Watched::stiffness].deadband = 0.5;  // in the middle it would not clear
  EXPECT_NE(fault_of(s), "");
  s[Watched::stiffness].deadband = 0.4;
  EXPECT_EQ(fault_of(s), "");
  s.stale.on_delay_s = -1.0;
  EXPECT_EQ(fault_of(s), "stale.on_delay_s must be >= 0");
  s.stale.on_delay_s = 0.0;
  s[Watched::gap].alarm.longest_shelving_s = 0.0;
  EXPECT_EQ(fault_of(s), "gap.longest_shelving_s must be > 0");
  s[Watched::gap].alarm.longest_shelving_s = 1.0;
  s[Watched::gap].high = std::nan("");
  EXPECT_EQ(fault_of(s), "gap.low must be below high");
}

/// Names of the tables and of the keys within them.
struct Names {
  std::set<std::string>& names;
  std::string path;
  template <class Field>
  void operator()(std::string_view name, Field& field, std::string_view doc) {
    EXPECT_FALSE(doc.empty()) << name;
    const std::string full = path + std::string(name);
    EXPECT_TRUE(names.insert(full).second) << full;
    if constexpr (std::is_class_v<Field>) describe(Names{names, full + "."}, field);
  }
};

TEST(AlarmSettings, EveryFigureAndConditionIsDescribed) {
  std::set<std::string> names;
  AxisAlarmSettings settings;
  describe(Names{names, ""}, settings);
  EXPECT_EQ(names.size(), 11 * (1 + 12) + 4 * (1 + 7));
  EXPECT_TRUE(names.contains("driven_inertia.low"));
  EXPECT_TRUE(names.contains("stale.severity"));
  EXPECT_FALSE(names.contains("stale.deadband"));
}

TEST(AlarmId, NamesAndPlacesAreUnique) {
  std::set<std::string> names;
  for (std::size_t i = 0; i < kAlarms; ++i) {
    const AlarmId id = AlarmId::of(i);
    EXPECT_EQ(id.index(), i);
    names.insert(alarm_name(id));
    EXPECT_EQ(alarm_from_name(alarm_name(id)), id);
  }
  EXPECT_EQ(names.size(), kAlarms);
  EXPECT_TRUE(names.contains("stiffness"));
  EXPECT_TRUE(names.contains("stiffness-limit"));
  EXPECT_TRUE(names.contains("controller"));
  EXPECT_FALSE(alarm_from_name("disk"));
}

}  // namespace
}  // namespace resonid::monitoring
