// SPDX-License-Identifier: GPL-3.0-or-later
// Randomly damaged text files, with a fixed seed. Each is read into valid samples, or refused with a message
// that names it.
#include <gtest/gtest.h>
#include <iconv.h>

#include <cmath>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include "tests/device/paths/text_files.h"

namespace {

std::vector<std::string> seeds() {
  std::string wide;
  for (const char c : std::string("t,x,y,z\n0,1,2,3\n")) wide += std::string(1, c) + '\0';
  return {
      "t_s,x_mm,y_mm,z_mm,fx_N,fy_N,fz_N\n0.0,10,20,10,0,0,0.1\n0.5,10,20,9.85,0,0,0.1\n1.0,10,20,9.7,0,0,"
      "0\n",
      "time [ms];x [m];y [m];z [m];fn [mN]\r\n0,5;0,01;0,02;0,03;1\r\n10,5;0,01;0,02;0,03;1\r\n",
      "t_s,x_um,y_um,z_um,fx_mN,fy_mN,fz_mN\n0.0,\"10,000.0\",\"20,000.0\",\"9,850.0\",\"0.0\",\"0.0\",\"1."
      "0\"\n",
      "# timestamp tx ty tz qx qy qz qw\r1617187200.1 1 2 3 0 0 0 1\r1617187200.2 1 2 3 0 0 0 1\r",
      "\xEF\xBB\xBFsep=;\nTime(\xC2\xB5s);POS_X_MM;POS_Y_MM;POS_Z_MM;Fx [N];Fy [N];Fz [N]\n0;1;2;3;4;5;6\n",
      "time\tx\ty\tz\tfx\tfy\tfz\n[s]\t[mm]\t[mm]\t[mm]\t[N]\t[N]\t[N]\n0\t1\t2\t3\t4\t5\t6\n",
      "time,x,y,z\n1617187200000000000,10,20,30\n1617187200010000000,10,20,30\n",
      "0.5 1 2 3 0.1 0.2 0.3\n0.501 2 3 4 0.4 0.5 0.6\n",
      "\xFF\xFE" + wide};
}

std::string damaged(std::string text, const std::string& other, std::mt19937_64& random) {
  const std::string marks = "\",;.\t \n\r[]()/_-+eEx0123456789%#\xC2\xB5N'";
  for (auto left = 1 + random() % 4; left > 0 && !text.empty(); --left) {
    const std::size_t at = random() % text.size();
    switch (random() % 5) {
      case 0:
        text[at] = static_cast<char>(random() % 256);
        break;
      case 1:
        text[at] = marks[random() % marks.size()];
        break;
      case 2:
        text.insert(at, 1, marks[random() % marks.size()]);
        break;
      case 3:
        text.erase(at, 1 + random() % 8);
        break;
      default:
        text = text.substr(0, at) + other.substr(random() % other.size());
    }
  }
  return text;
}

void expect_sound(const std::vector<double>& t_s, const std::vector<glm::dvec3>& position_m) {
  ASSERT_FALSE(t_s.empty());
  ASSERT_EQ(t_s.size(), position_m.size());
  ASSERT_EQ(t_s.front(), 0.0);
  for (std::size_t i = 0; i < t_s.size(); ++i) {
    ASSERT_TRUE(i == 0 || t_s[i] > t_s[i - 1]);
    ASSERT_TRUE(std::isfinite(position_m[i].x + position_m[i].y + position_m[i].z));
  }
}

// Asks iconv() of the C library.
bool is_utf8(std::string text) {
  const iconv_t converter = iconv_open("UTF-32LE", "UTF-8");
  std::string out(4 * text.size() + 8, '\0');
  char *from = text.data(), *to = out.data();
  std::size_t left = text.size(), room = out.size();
  const bool converted =
      iconv(converter, &from, &left, &to, &room) != static_cast<std::size_t>(-1) && left == 0;
  iconv_close(converter);
  return converted;
}

TEST(TextDamaged, IsReadIntoSoundSamplesOrRefusedByName) {
  const char* asked = std::getenv("HYBRID_FUZZ_TEXTS");
  const int texts = asked != nullptr ? std::atoi(asked) : 1000;
  const std::vector<std::string> all = seeds();
  std::mt19937_64 random(20261127);
  int read = 0, refused = 0;
  for (int n = 0; n < texts; ++n) {
    const std::string text = damaged(all[random() % all.size()], all[random() % all.size()], random);
    SCOPED_TRACE(testing::PrintToString(text));
    try {
      const auto measured = tests::measured_of(text);
      expect_sound(measured.t_s, measured.position_m);
      ASSERT_TRUE(measured.force_N.size() == measured.t_s.size() ||
                  measured.strength_N.size() == measured.t_s.size());
      ++read;
    } catch (const device::PathError& error) {
      ASSERT_NE(std::string(error.what()).find("a file.csv"), std::string::npos);
      ++refused;
    }
    const std::string words = tests::refusal_of([&] {
      const auto path = tests::path_of(text);
      expect_sound(path.t_s, path.position_m);
      return path;
    });
    ASSERT_TRUE(words.empty() || words.find("a file.csv") != std::string::npos) << words;
    ASSERT_TRUE(is_utf8(words)) << words;
    for (const char c : words) ASSERT_TRUE(static_cast<unsigned char>(c) >= ' ' && c != 0x7F) << words;
  }
  EXPECT_GT(read, texts / 20);
  EXPECT_GT(refused, texts / 20);
}

}  // namespace
