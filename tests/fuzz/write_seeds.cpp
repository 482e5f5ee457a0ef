// SPDX-License-Identifier: Apache-2.0
// write_seeds FOLDER: the seed corpus, one folder per fuzz target.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

#include "fuzz/seeds.h"

int main(int count, char** arguments) {
  if (count != 2) return 2;
  std::vector<asbuilt::test::Seed> seeds = asbuilt::test::seeds();
  std::ranges::move(asbuilt::test::live_seeds(), std::back_inserter(seeds));
  for (const asbuilt::test::Seed& seed : seeds) {
    const auto folder = std::filesystem::path(arguments[1]) / seed.family;
    std::filesystem::create_directories(folder);
    std::ofstream stream(folder / seed.name, std::ios::binary);
    stream << seed.content;
    if (!stream.flush()) return 1;
  }
  return 0;
}
