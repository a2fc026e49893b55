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

/// Two columns of three rows, the first of times.
expected<Table, Error> with_times(const std::array<std::string, 3>& times) {
  std::string text = "Time,u\n";
  for (const auto& time : times) text += time + ",1.5\n";
  return read_text(text);
}

TEST(CsvReader, ReadsTimesWithAndWithoutHours) {
  struct Case {
    std::array<std::string, 3> times;
    Column seconds;
    const char* note;
  };
  const Case cases[] = {
      {{"10:00:00.5", "10:00:01", "10:00:01.5"}, {36000.5, 36001.0, 36001.5}, "'Time' read as HH:MM:SS"},
      {{"23:59:59", "23:59:59.5", "00:00:00"},
       {86399.0, 86399.5, 86400.0},
       "'Time' read as HH:MM:SS, going on after midnight"},
      {{"25:00:00", "25:00:00.25", "125:00:00"}, {90000.0, 90000.25, 450000.0}, "'Time' read as HH:MM:SS"},
      {{"02:03", "02:04", "02:05"}, {123.0, 124.0, 125.0}, "'Time' read as minutes and seconds (mm:ss)"},
      {{"2:03.125", "2:03.250", "2:03.375"},
       {123.125, 123.25, 123.375},
       "'Time' read as minutes and seconds (mm:ss)"},
      {{"59:59.5", "60:00.0", "75:12.5"},
       {3599.5, 3600.0, 4512.5},
       "'Time' read as minutes and seconds (mm:ss)"},
      {{"59:59.5", "00:00.0", "00:00.5"},
       {3599.5, 3600.0, 3600.5},
       "'Time' read as minutes and seconds (mm:ss), going on after the full hour"},
      {{"59:59.5", "1:00:00.0", "1:00:00.5"},
       {3599.5, 3600.0, 3600.5},
       "'Time' read as minutes and seconds (mm:ss)"}};
  for (const auto& c : cases) {
    const auto table = with_times(c.times);
    ASSERT_TRUE(table) << message_of(table.error());
    ASSERT_EQ(table->names, (Names{"Time", "u"})) << c.times[0];
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(table->columns[0][k], c.seconds[k], 1e-9) << c.times[k];
    ASSERT_EQ(table->notes.size(), 1U);
    EXPECT_EQ(table->notes.front(), c.note);
  }
}

/// What only looks like a time is text: minutes of the day that stand still, ratios, hours beyond the day.
TEST(CsvReader, DoesNotTakeEverythingWithAColonForATime) {
  for (const std::array<std::string, 3>& times :
       {std::array<std::string, 3>{"14:03", "14:03", "14:03"},
        {"1:5", "1:6", "1:7"},
        {"14:61", "14:62", "14:63"},
        {"2026-11-27T25:00:00", "2026-11-27T25:00:01", "2026-11-27T25:00:02"},
        {"2:03 PM", "2:04 PM", "2:05 PM"}}) {
    const auto table = with_times(times);
    ASSERT_TRUE(table) << message_of(table.error());
    EXPECT_EQ(table->names, (Names{"u"})) << times[0];
    ASSERT_EQ(table->unusable.size(), 1U);
  }
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
  RESONID_EXPECT_MESSAGE(read_text(""), "record.csv: the file is empty; required: rows of numbers");
  RESONID_EXPECT_MESSAGE(read_text("# nothing\n\n"), "holds only comments and blank lines");
  RESONID_EXPECT_MESSAGE(read_text("t,u\n"), "has a header (line 1) but no samples");
  RESONID_EXPECT_MESSAGE(read_text("t,u"), "has a header (line 1) but no samples");
  RESONID_EXPECT_MESSAGE(read_text("# x\nt,u\n1,2\n"),
                         "has only one row of samples (line 3); at least 2 are required");
}

TEST(CsvReader, SaysWhatIsWrongWithTheHeader) {
  RESONID_EXPECT_MESSAGE(
      read_text("0,1,2,3\n1,2,3,4\n2,3,4,5\n5,6\n7,8\n9,1\n2,3\n4,5\n6,7\n8,9\n1,2\n3,4\n5,6\n7,8\n9,1\n"),
      "line 1: has 4 fields, from line 4 on rows have 2");
  RESONID_EXPECT_MESSAGE(read_text("t,u\n0,1,2\n1,2,3\n"),
                         "line 2: has 3 fields, the header (line 1) names 2 columns");
}

TEST(CsvReader, SaysWhatIsWrongWithARow) {
  const std::string head = "t,u\n0,1\n2,3\n";
  const std::string rest = "\n3,4\n";
  RESONID_EXPECT_MESSAGE(read_text(head + "1,abc" + rest),
                         "record.csv: line 4, column 'u': 'abc' is not a number");
  RESONID_EXPECT_MESSAGE(read_text(head + "1,2x" + rest), "line 4, column 'u': '2x' is not a number");
  RESONID_EXPECT_MESSAGE(read_text(head + "1,1e" + rest), "line 4, column 'u': '1e' is not a number");
  RESONID_EXPECT_MESSAGE(read_text(head + "1,1e999" + rest), "'1e999' is larger than a double can hold");
  for (const char* word : {"-inf", "Infinity"})
    RESONID_EXPECT_MESSAGE(read_text(head + "1," + word + rest),
                           "line 4, column 'u': '" + std::string(word) + "' is not a finite number");
  RESONID_EXPECT_MESSAGE(read_text(head + "1" + rest),
                         "line 4: has 1 field, the header (line 1) names 2 columns");
  RESONID_EXPECT_MESSAGE(read_text(head + "1,2,3" + rest),
                         "line 4: has 3 fields, the header (line 1) names 2 columns");
  RESONID_EXPECT_MESSAGE(read_text(head + "1,\"2" + rest),
                         "line 4, column 'u': the quote before '2' is not closed");
}

TEST(CsvReader, MarksWhatIsMissing) {
  const auto table =
      read_text("t,u,y\n0,,1\n1,NaN,2\n2,#NV,3\n3,4,4\n4,null,5\n5,n/a,6\n6,1,7\n7,2,8\n8,3,9\n9,4,\n");
  ASSERT_TRUE(table) << message_of(table.error());
  const auto missing = [&](std::size_t column) {
    std::vector<std::size_t> rows;
    for (std::size_t i = 0; i < table->columns[column].size(); ++i)
      if (std::isnan(table->columns[column][i])) rows.push_back(i);
    return rows;
  };
  EXPECT_EQ(missing(1), (std::vector<std::size_t>{0, 1, 2, 4, 5}));
  EXPECT_EQ(missing(2), (std::vector<std::size_t>{9}));
  EXPECT_EQ(table->columns[1][3], 4.0);
}

struct Spelling {
  const char* what;
  const char* text;
};

/// The same table, t = 0, 0.5, 1 and u = -1.5, 2000, 0.25, as others write it.
TEST(CsvReader, TellsHowATableIsWritten) {
  const Spelling spellings[] = {
      {"decimal comma, semicolon", "t;u\n0;-1,5\n0,5;2,0e3\n1;0,25\n"},
      {"decimal comma, tab", "t\tu\r\n0\t-1,5\r\n0,5\t2000\r\n1\t,25\r\n"},
      {"decimal comma, blanks", "t u\n0 -1,5\n0,5 2000\n1 0,25\n"},
      {"aligned with blanks", "  t      u\n  0   -1.5\n0.5  2000 \n  1   0.25\n"},
      {"bars", "t|u\n0|-1.5\n0.5|2000\n1|0.25\n"},
      {"a preamble", "Axis 3\nDate: 2026-01-05; operator: x\n\nt;u\n0;-1.5\n0.5;2000\n1;0.25\n"},
      {"a preamble of pairs", "Axis,3\nRate,2\nt,u\n0,-1.5\n0.5,2000\n1,0.25\n"},
      {"names in a comment", "# made by a script\n# t,u\n0,-1.5\n0.5,2000\n1,0.25\n"},
      {"quoted numbers", "\"t\",\"u\"\n\"0\",\"-1.5\"\n\"0.5\",\"2000\"\n\"1\",\"0.25\"\n"},
      {"an end mark", "t,u\n0,-1.5\n0.5,2000\n1,0.25\nEOF\n"},
      {"statistics below", "t,u\n0,-1.5\n0.5,2000\n1,0.25\n\nmean,3\nmax,4\n"},
      {"a torn line", "t,u\n0,-1.5\n0.5,2000\n1,0.25\n1.5"},
      {"a number cut off", "t,u\n0,-1.5\n0.5,2000\n1,0.25\n1.5,2"},
      {"a column of text", "t,state,u\n0,run,-1.5\n0.5,run,2000\n1,stop,0.25\n"},
      {"separators at the end", "t;u;\n0;-1,5;\n0,5;2000;\n1;0,25;\n"},
      {"separators at the end of the rows", "t,u\n0,-1.5,\n0.5,2000,\n1,0.25,\n"},
  };
  for (const auto& s : spellings) {
    const auto table = read_text(s.text);
    ASSERT_TRUE(table) << s.what << ": " << message_of(table.error());
    EXPECT_EQ(table->names, (Names{"t", "u"})) << s.what;
    EXPECT_EQ(table->columns[0], (Column{0.0, 0.5, 1.0})) << s.what;
    EXPECT_EQ(table->columns[1], (Column{-1.5, 2000.0, 0.25})) << s.what;
    const bool usual =
        s.what == std::string("quoted numbers") || s.what == std::string("separators at the end of the rows");
    EXPECT_EQ(table->notes.empty(), usual) << s.what << ": must say what was sniffed";
  }
}

TEST(CsvReader, NamesColumnsWhereTheFileDoesNot) {
  EXPECT_EQ(read_text("0,1\n2,3\n")->names, (Names{"c1", "c2"}));
  EXPECT_EQ(read_text("t,,u\n0,1,2\n1,2,3\n")->names, (Names{"t", "c2", "u"}));
  EXPECT_EQ(read_text("t,u,t\n0,1,2\n1,2,3\n")->names, (Names{"t", "u", "t#2"}));
  EXPECT_EQ(read_text("Log closed\n0;1\n2;3\n")->names, (Names{"c1", "c2"}));
}

TEST(CsvReader, TakesARowOfUnits) {
  for (const char* text :
       {"t;n;M\nms;1/min;Nm\n0;1;2\n1;2;3\n", "t;n;M\n[ms];[1/min];[Nm]\n0;1;2\n1;2;3\n"}) {
    const auto table = read_text(text);
    ASSERT_TRUE(table) << message_of(table.error());
    EXPECT_EQ(table->names, (Names{"t", "n", "M"}));
    EXPECT_EQ(table->units, (Names{"ms", "1/min", "Nm"}));
  }
}

TEST(CsvReader, ReadsPropertiesOfChannels) {
  const std::string head = "Name\tScope 1\nFile\tx.svdx\n\n";
  const auto own = read_text(head +
                             "Name\tM\tName\tn\nSampleTime[ms]\t1\tSampleTime[ms]\t1\nUnit\tNm\tUnit\trpm\n\n"
                             "0\t1,5\t0\t7\n1\t2,5\t1\t8\n");
  ASSERT_TRUE(own) << message_of(own.error());
  EXPECT_EQ(own->names, (Names{"time", "M", "time#2", "n"}));
  EXPECT_EQ(own->units, (Names{"ms", "Nm", "ms", "rpm"}));
  EXPECT_EQ(own->columns[1], (Column{1.5, 2.5}));
  const auto shared = read_text(head + "Name;M;n\nData-Type;REAL64;REAL64\n\n0;1,5;7\n1;2,5;8\nEOF\n");
  ASSERT_TRUE(shared) << message_of(shared.error());
  EXPECT_EQ(shared->names, (Names{"time", "M", "n"}));
}

TEST(CsvReader, ReadsTimesOfDay) {
  const auto table = read_text("Time;u\n23:59:59,5;1\n00:00:00,0;2\n00:00:00,5;3\n");
  ASSERT_TRUE(table) << message_of(table.error());
  EXPECT_EQ(table->columns[0], (Column{86399.5, 86400.0, 86400.5}));
  EXPECT_EQ(read_text("at,u\n2026-11-27T01:00:00.25Z,1\n2026-11-27T01:00:00.5Z,1\n")->columns[0],
            (Column{3600.25, 3600.5}));
  EXPECT_EQ(read_text("at,u\n1:00:01 PM,1\n1:00:02 PM,1\n")->columns[0], (Column{46801, 46802}));
}

std::string utf16(std::string_view text, bool big, bool mark) {
  std::string bytes = mark ? (big ? "\xfe\xff" : "\xff\xfe") : "";
  for (const char c : text) {
    if (big) bytes += '\0';
    bytes += c;
    if (!big) bytes += '\0';
  }
  return bytes;
}

TEST(CsvReader, ReadsOtherCharacterSets) {
  const std::string_view text = "t,u\r\n0,1\r\n2,3\r\n";
  for (const bool big : {false, true})
    for (const bool mark : {false, true}) {
      const auto table = read_text(utf16(text, big, mark));
      ASSERT_TRUE(table) << message_of(table.error());
      EXPECT_EQ(table->names, (Names{"t", "u"}));
      EXPECT_EQ(table->columns[1], (Column{1, 3}));
    }
  EXPECT_EQ(read_text("t;Winkel [\xb0]\n0;1\n2;3\n")->names[1], "Winkel [\u00b0]");
}

TEST(CsvReader, DoesWhatTheLayoutSays) {
  const TemporaryFolder folder;
  const auto path = folder.file("record.csv", "a,b\nt,u\n1,2\n3,4\n");
  EXPECT_EQ(read_csv(path, {.header_line = 1})->names, (Names{"a", "b"}));
  EXPECT_EQ(read_csv(path, {.header_line = 0})->names, (Names{"c1", "c2"}));

  EXPECT_EQ(read_csv(path, {.skip_lines = 1})->names, (Names{"t", "u"}));
  RESONID_EXPECT_MESSAGE(read_csv(path, {.skip_lines = 10}), ".skip_lines");
  const auto integers = folder.file("i.csv", "t;u\n1;2\n3;4\n");
  EXPECT_EQ(read_csv(integers, {.decimal = ','})->columns[1], (Column{2, 4}));
}

TEST(CsvReader, ExplainsDecimalCommas) {
  RESONID_EXPECT_MESSAGE(
      read_text("t,u\n0,1,0,2\n0,2,0,3\n"),
      "numbers must be written with a decimal point, or columns separated by semicolon or tab");
  RESONID_EXPECT_MESSAGE(read_text("t;u\n0;1\n1;2\n2;3\n3;4\n4;5\n5;6\n6;7\n7;8\n8;9\n9;1.234,5\n"),
                         "'1.234,5' has thousands separators");
}

TEST(CsvReader, CountsTheCommentsAmongTheSamples) {
  const auto table = read_text("t,u\n0,1\n# pause\n1,2\n#2,3\n3,4\n");
  ASSERT_TRUE(table) << message_of(table.error());
  EXPECT_EQ(table->columns[0], (Column{0, 1, 3}));
  EXPECT_EQ(table->notes, (Names{"2 comments (#) among the samples left out"}));
  const auto missing = read_text("u,y\n1,2\n#NA,3\n#N/A,4\n5,6\n");
  EXPECT_EQ(missing->columns[0].size(), 4U);
}

TEST(CsvReader, TakesARowWithoutAnyNumberForASample) {
  const auto table = read_text("u,y\nNaN,NaN\n1,2\n3,4\n");
  ASSERT_TRUE(table) << message_of(table.error());
  EXPECT_EQ(table->names, (Names{"u", "y"}));
}

TEST(CsvReader, SaysWhyAColumnIsText) {
  const auto table = read_text("t;n\n0;2.012,3\n1;2.013,4\n2;2.014,5\n");
  ASSERT_TRUE(table) << message_of(table.error());
  ASSERT_EQ(table->unusable.size(), 1U);
  EXPECT_NE(table->unusable[0].reason.find("thousands separators"), std::string::npos)
      << table->unusable[0].reason;
}

TEST(CsvReader, RefusesALayoutThatLeavesNothing) {
  const TemporaryFolder folder;
  const auto path = folder.file("record.csv", "t,u\n0,1\n1,2\n# end\n");
  TextLayout layout;
  layout.skip_lines = 3;
  RESONID_EXPECT_MESSAGE(read_csv(path, layout), "holds only comments and blank lines");
}

TEST(CsvReader, SaysWhatToDoWithAWorkbook) {
  RESONID_EXPECT_MESSAGE(read_text("PK\x03\x04..."), "save the sheet as CSV");
}

}  // namespace
}  // namespace resonid::io
