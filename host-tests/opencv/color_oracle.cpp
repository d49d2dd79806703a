// Grey and HSV of every 8-bit colour, and grey of every RGB565 pixel, against cv::cvtColor.
// Exits 1 and prints the first difference if there is one.
#include <cstdio>
#include <opencv2/imgproc.hpp>

extern "C" {
#include "vision/color.h"
}

namespace
{

// All colours of one red, as a 256x256 picture: green down, blue across.
cv::Mat colours_of_red(int red)
{
    cv::Mat picture(256, 256, CV_8UC3);
    for (int green = 0; green < 256; green++)
        for (int blue = 0; blue < 256; blue++)
            picture.at<cv::Vec3b>(green, blue) = cv::Vec3b(
                static_cast<uchar>(red), static_cast<uchar>(green), static_cast<uchar>(blue));
    return picture;
}

long compare_red(int red)
{
    cv::Mat picture = colours_of_red(red);
    cv::Mat grey;
    cv::Mat hsv;
    long differences = 0;
    cv::cvtColor(picture, grey, cv::COLOR_RGB2GRAY);
    cv::cvtColor(picture, hsv, cv::COLOR_RGB2HSV);
    for (int green = 0; green < 256; green++) {
        for (int blue = 0; blue < 256; blue++) {
            const auto r = static_cast<uint8_t>(red);
            const auto g = static_cast<uint8_t>(green);
            const auto b = static_cast<uint8_t>(blue);
            const uint8_t our_grey = color_grey(r, g, b);
            const hsv_t our_hsv = color_hsv(r, g, b);
            const uint8_t their_grey = grey.at<uint8_t>(green, blue);
            const cv::Vec3b their_hsv = hsv.at<cv::Vec3b>(green, blue);
            if (our_grey == their_grey && our_hsv.hue == their_hsv[0] &&
                our_hsv.saturation == their_hsv[1] && our_hsv.value == their_hsv[2])
                continue;
            if (differences++ == 0)
                std::printf("rgb %d,%d,%d: grey %d, OpenCV %d; hsv %d,%d,%d, OpenCV %d,%d,%d\n",
                            red, green, blue, our_grey, their_grey, our_hsv.hue, our_hsv.saturation,
                            our_hsv.value, their_hsv[0], their_hsv[1], their_hsv[2]);
        }
    }
    return differences;
}

long compare_565()
{
    cv::Mat pixels(256, 256, CV_8UC2);
    cv::Mat grey;
    long differences = 0;
    for (int value = 0; value < 65536; value++) // OpenCV wants the low byte first
        pixels.at<cv::Vec2b>(value >> 8, value & 255) =
            cv::Vec2b(static_cast<uchar>(value & 255), static_cast<uchar>(value >> 8));
    cv::cvtColor(pixels, grey, cv::COLOR_BGR5652GRAY);
    for (int value = 0; value < 65536; value++) {
        const uint8_t ours = color_grey565(static_cast<uint16_t>(value));
        const uint8_t theirs = grey.at<uint8_t>(value >> 8, value & 255);
        if (ours != theirs && differences++ == 0)
            std::printf("rgb565 %04x: grey %d, OpenCV %d\n", static_cast<unsigned>(value), ours,
                        theirs);
    }
    return differences;
}

} // namespace

int main()
{
    long differences = compare_565();
    for (int red = 0; red < 256; red++)
        differences += compare_red(red);
    std::printf("16777216 colours and 65536 RGB565 pixels: %ld differ from OpenCV\n", differences);
    return differences != 0;
}
