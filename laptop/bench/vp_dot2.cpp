// ViSP's vpDot2, to be measured beside our tracker: see track_dot2.py.
//
// in   "width height", then per picture a line "u v", where the blob is taken up, px, and
//      width * height grey bytes; the place counts in the first picture and after each loss
// out  per picture "u v", px, or "lost"
#include <visp3/core/vpConfig.h>
// Else its headers want OpenCV's, for conversions that are not needed here.
#undef VISP_HAVE_OPENCV
#include <visp3/blob/vpDot2.h>

#include <iomanip>
#include <iostream>

// What is half disc and more belongs to it.
const unsigned int HALF = 128, FULL = 255;

int main() {
  unsigned int width = 0, height = 0;
  std::cin >> width >> height;
  vpImage<unsigned char> image(height, width);
  vpDot2 dot;
  bool followed = false;
  std::cout << std::setprecision(9);
  for (double u, v; std::cin >> u >> v;) {
    std::cin.get(); // the end of the line
    if (!std::cin.read(reinterpret_cast<char *>(image.bitmap), image.getSize())) {
      std::cerr << "error: the picture is cut off\n";
      return 1;
    }
    try {
      if (followed) {
        dot.track(image);
      } else {
        dot = vpDot2();
        dot.initTracking(image, vpImagePoint(v, u), HALF, FULL);
      }
      followed = true;
      std::cout << dot.getCog().get_u() << ' ' << dot.getCog().get_v() << '\n';
    } catch (const vpException &) {
      followed = false;
      std::cout << "lost\n";
    }
  }
}
