// SPDX-License-Identifier: MIT
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <resonid/base/error_text.hpp>
#include <resonid/io/detail/table.hpp>

#include "temporary_folder.hpp"

namespace resonid::io {
namespace {

using test::TemporaryFolder;
using Column = std::vector<double>;
using Names = std::vector<std::string>;

expected<Table, Error> read_text(std::string_view text) {
  const TemporaryFolder folder;
  return read_csv(folder.file("record.csv", text));
}

TEST(CsvReader, ReadsCommaSemicolonAndTab) {
  for (const std::string separator : {",", ";", "\t"}) {
    const auto join = [&](const char* a, const char* b) { return a + separator + b + "\n"; };
    const auto table = read_text(join("t_s", "u") + join("0", "-1.5") + join("0.5", "2e3"));
    ASSERT_TRUE(table) << message_of(table.error());
    EXPECT_EQ(table->names, (Names{"t_s", "u"}));
    EXPECT_EQ(table->columns[0], (Column{0.0, 0.5}));
    EXPECT_EQ(table->columns[1], (Column{-1.5, 2000.0}));
  }
}

TEST(CsvReader, SkipsCommentsBlankLinesBlanksAndByteOrderMark) {
  const auto table = read_text(
      "\xef\xbb\xbf# made by hand\r\n\r\n t , \"u, \"\"raw\"\"\"\r\n 1 , 2\t\r\n   \r\n# "
      "pause\r\n3,\"4\"\r\n5 ,+6");
  ASSERT_TRUE(table) << message_of(table.error());
  EXPECT_EQ(table->names, (Names{"t", "u, \"raw\""}));
  EXPECT_EQ(table->columns[0], (Column{1, 3, 5}));
  EXPECT_EQ(table->columns[1], (Column{2, 4, 6}));
  EXPECT_EQ(table->place(0), "line 4");
  EXPECT_EQ(table->place(1), "line 7");
  EXPECT_EQ(table->place(2), "line 8");
}

TEST(CsvReader, AcceptsASeparatorAtTheEndOfEveryLineAndOldLineEnds) {
  const auto table = read_text("t,u,\n1,2,\n3,4 , \n5,6\n");
  ASSERT_TRUE(table) << message_of(table.error());
  EXPECT_EQ(table->columns[1], (Column{2, 4, 6}));
  const auto old = read_text("t,u\r1,2\r3,4\r");
  ASSERT_TRUE(old) << message_of(old.error());
  EXPECT_EQ(old->columns[1], (Column{2, 4}));
}

/// All ways through the number scanner: few and many digits, exponents, subnormal, far too small, ties.
TEST(CsvReader, RoundsNumbersLikeTheStandardLibrary) {
  std::vector<std::string> texts = {"0",
                                    "-0",
                                    ".5",
                                    "5.",
                                    "1e22",
                                    "1e23",
                                    "9007199254740993",
                                    "1e-22",
                                    "5e-324",
                                    "1e-400",
                                    "-1e-400",
                                    "1.7976931348623157e308",
                                    "2.2250738585072011e-308",
                                    "9007199254740993e5",
                                    "0.1e1",
                                    "00000000000000000000000001.5",
                                    "18446744073709551615",
                                    "1.8446744073709551615",
                                    "9999999999999999999e-27",
                                    "1234567890123456789012345",
                                    "0.3000000000000000166533453693773481063544750213623046875",
                                    "9007199254740993.0",
                                    "4503599627370496.5",
                                    "4503599627370497.5e-27",
                                    "123456789012345678.9E+05"};
  std::mt19937_64 random(7);
  std::uniform_int_distribution<std::uint64_t> digits(0, 9'999'999'999'999'999'999U);
  std::uniform_int_distribution<int> exponent(-30, 30);
  for (int i = 0; i < 20'000; ++i)
    texts.push_back(std::to_string(digits(random) >> (i % 64)) + "e" + std::to_string(exponent(random)));
  std::string file = "x\n";
  for (const auto& text : texts) file += text + "\n";
  const auto table = read_text(file);
  ASSERT_TRUE(table) << message_of(table.error());
  ASSERT_EQ(table->columns[0].size(), texts.size());
  for (std::size_t i = 0; i < texts.size(); ++i)
    EXPECT_EQ(std::bit_cast<std::uint64_t>(table->columns[0][i]),
              std::bit_cast<std::uint64_t>(std::strtod(texts[i].c_str(), nullptr)))
        << texts[i];
}

TEST(CsvReader, GivesBackRandomDoublesBitForBit) {
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal;
  std::vector<double> values;
  while (values.size() < 30'000) {
    const double any = std::bit_cast<double>(random());  // all exponents
    if (std::isfinite(any)) values.push_back(any);
    values.push_back(normal(random));
  }
  std::string file = "a;b\n";
  std::array<char, 64> text{};
  for (std::size_t i = 0; i < values.size(); i += 2) {
    std::snprintf(text.data(), text.size(), "%.17g;%.16e\n", values[i], values[i + 1]);
    file += text.data();
  }
  const auto table = read_text(file);
  ASSERT_TRUE(table) << message_of(table.error());
  for (std::size_t i = 0; i < values.size(); ++i)
    ASSERT_EQ(std::bit_cast<std::uint64_t>(table->columns[i % 2][i / 2]),
              std::bit_cast<std::uint64_t>(values[i]))
        << i;
}

/// A file large enough to be read in regions by several threads, with lines that are no rows between the
/// rows.
class LargeCsv : public ::testing::Test {
 protected:
  static constexpr std::size_t kRows = 700'000;
  static bool has_comment(std::size_t row) { return row % 100'000 == 99'999; }
  static std::string text() {
    std::string file = "n,twice\n";
    for (std::size_t i = 0; i < kRows; ++i) {
      file += std::to_string(i) + "," + std::to_string(2 * i) + "\n";
      if (has_comment(i)) file += "# a comment after row " + std::to_string(i) + "\n\n";
    }
    return file;
  }
};

TEST_F(LargeCsv, KeepsOrderAndLineNumbers) {
  const auto table = read_text(text());
  ASSERT_TRUE(table) << message_of(table.error());
  ASSERT_EQ(table->columns[0].size(), kRows);
  std::size_t line = 2;
  for (std::size_t i = 0; i < kRows; ++i, ++line) {
    ASSERT_EQ(table->columns[0][i], static_cast<double>(i));
    ASSERT_EQ(table->columns[1][i], static_cast<double>(2 * i));
    if (i % 997 == 0 || has_comment(i)) {
      ASSERT_EQ(table->place(i), "line " + std::to_string(line));
    }
    if (has_comment(i)) line += 2;
  }
}

TEST_F(LargeCsv, NamesTheFirstBadLine) {
  std::string file = text();
  const std::size_t late = file.find("\n650000,");
  file[late + 2] = 'x';
  RESONID_EXPECT_MESSAGE(read_text(file), "line 650014, column 'n': '6x0000' is not a number");
  const std::size_t early = file.find("\n600000,");
  file[early + 7] = ' ';  // the line loses a field
  RESONID_EXPECT_MESSAGE(read_text(file), "line 600014: has 1 field, the header (line 1) names 2 columns");
}

TEST(CsvReader, ReadsALineLongerThanItsBuffer) {
  std::string header = "c0";
  std::string row = "0";
  for (int i = 1; i < 3000; ++i) {
    header += ",c" + std::to_string(i);
    row += "," + std::string(120, ' ') + std::to_string(i);
  }
  const auto table = read_text(header + "\n" + row + "\n" + row + "\n");
  ASSERT_TRUE(table) << message_of(table.error());
  EXPECT_EQ(table->columns[2999], (Column{2999, 2999}));
}

TEST(CsvReader, SaysWhatIsWrongWithTheFile) {
  const TemporaryFolder folder;
  RESONID_EXPECT_MESSAGE(read_csv(folder / "absent.csv"), "absent.csv: there is no such file");
  RESONID_EXPECT_MESSAGE(read_csv(folder.path()), ": is a folder, a file is required");
  RESONID_EXPECT_MESSAGE(read_text(""), "record.csv: the file is empty; required: a header row");
  RESONID_EXPECT_MESSAGE(read_text("# nothing\n\n"), "holds only comments and blank lines");
  RESONID_EXPECT_MESSAGE(read_text("t,u\n"), "has a header (line 1) but no samples");
  RESONID_EXPECT_MESSAGE(read_text("t,u"), "has a header (line 1) but no samples");
  RESONID_EXPECT_MESSAGE(read_text("# x\nt,u\n1,2\n"),
                         "has only one row of samples (line 3); at least 2 are required");
  RESONID_EXPECT_MESSAGE(read_text("\xff\xfet\0,\0"), "is UTF-16 text");
}

TEST(CsvReader, SaysWhatIsWrongWithTheHeader) {
  RESONID_EXPECT_MESSAGE(read_text("0,1\n2,3\n"), "line 1: has '0,1' where the column names should be");
  RESONID_EXPECT_MESSAGE(read_text("# t,u\n0,1\n2,3\n"),
                         "a line that begins with # is a comment, not the header");
  RESONID_EXPECT_MESSAGE(read_text("t,u,t\n0,1,2\n"), "line 1: columns 1 and 3 are both called 't'");
  RESONID_EXPECT_MESSAGE(read_text("t,,u\n0,1,2\n"), "line 1: column 2 has no name");
  RESONID_EXPECT_MESSAGE(read_text("\"t,u\n0,1\n"), "line 1: the quote before 't,u' is not closed");
}

TEST(CsvReader, SaysWhatIsWrongWithARow) {
  const std::string head = "t,u\n0,1\n";
  RESONID_EXPECT_MESSAGE(read_text(head + "1,abc\n"),
                         "record.csv: line 3, column 'u': 'abc' is not a number");
  RESONID_EXPECT_MESSAGE(read_text(head + "1,2x\n"), "line 3, column 'u': '2x' is not a number");
  RESONID_EXPECT_MESSAGE(read_text(head + "1,1e\n"), "line 3, column 'u': '1e' is not a number");
  RESONID_EXPECT_MESSAGE(read_text(head + "1,\n"), "line 3, column 'u': is empty; a number is required");
  RESONID_EXPECT_MESSAGE(read_text(head + "1,1e999\n"), "'1e999' is larger than a double can hold");
  for (const char* word : {"nan", "NaN", "-inf", "Infinity"})
    RESONID_EXPECT_MESSAGE(read_text(head + "1," + word + "\n"),
                           "line 3, column 'u': '" + std::string(word) + "' is not a finite number");
  RESONID_EXPECT_MESSAGE(read_text(head + "1\n"), "line 3: has 1 field, the header (line 1) names 2 columns");
  RESONID_EXPECT_MESSAGE(read_text(head + "1,2,3\n"),
                         "line 3: has 3 fields, the header (line 1) names 2 columns");
  RESONID_EXPECT_MESSAGE(read_text(head + "1,\"2\n"),
                         "line 3, column 'u': the quote before '2' is not closed");
}

TEST(CsvReader, ExplainsDecimalCommasAndUnknownSeparators) {
  RESONID_EXPECT_MESSAGE(read_text("t;u\n0,1;0,2\n"),
                         "line 2, column 't': '0,1' has a decimal comma; write numbers with a decimal point");
  RESONID_EXPECT_MESSAGE(read_text("t,u\n0,1,0,2\n"),
                         "numbers must be written with a decimal point, not a comma");
  RESONID_EXPECT_MESSAGE(read_text("t u y\n0 1 2\n"), "columns must be separated by comma, semicolon or tab");
}

}  // namespace
}  // namespace resonid::io
