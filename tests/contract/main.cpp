// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cstdlib>
#include <string_view>

#include "subject.hpp"

int main(int argc, char** argv) {
  if (argc == 2 && std::string_view(argv[1]) == "--resume")
    return resonid::test::resume_from_standard_input();
  if (argc == 2 && std::string_view(argv[1]) == "--write-table") return resonid::test::write_table();
  setenv("RC_PARAMS", "seed=6", 0);  // of RapidCheck: fixed unless asked for another
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
