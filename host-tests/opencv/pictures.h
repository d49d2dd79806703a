// Picture pairs that the comparisons with OpenCV run on.
#ifndef PICTURES_H
#define PICTURES_H

#include <cstdio>
#include <cstdlib>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

extern "C" {
#include "vision/dense.h"
}

struct Pair {
    std::string name;
    cv::Mat left; // grey
    cv::Mat right;
};

// A missing picture ends the program: a comparison with nothing must not pass.
inline cv::Mat read_picture(const std::string &path, int flags)
{
    cv::Mat picture = cv::imread(path, flags);
    if (picture.empty()) {
        std::fprintf(stderr, "cannot read %s; tools/setup test installs opencv-doc\n",
                     path.c_str());
        std::exit(1);
    }
    return picture;
}

inline cv::Mat scaled(const cv::Mat &picture, cv::Size size)
{
    cv::Mat small;
    cv::resize(picture, small, size, 0, 0, cv::INTER_AREA);
    return small;
}

inline Pair aloe(cv::Size size)
{
    const std::string folder = STEREOSOT_ALOE;
    return {"aloe " + std::to_string(size.width) + "x" + std::to_string(size.height),
            scaled(read_picture(folder + "/aloeL.jpg", cv::IMREAD_GRAYSCALE), size),
            scaled(read_picture(folder + "/aloeR.jpg", cv::IMREAD_GRAYSCALE), size)};
}

// Noise whose right half-image is the left one shifted by a third of the width at most, plus noise
// of its own.
inline Pair noise(cv::RNG &random, cv::Size size)
{
    Pair pair{"noise " + std::to_string(size.width) + "x" + std::to_string(size.height),
              cv::Mat(size, CV_8U), cv::Mat(size, CV_8U)};
    random.fill(pair.left, cv::RNG::UNIFORM, 0, 256);
    random.fill(pair.right, cv::RNG::UNIFORM, 0, 20);
    const int shift = random.uniform(0, size.width / 3 + 1);
    cv::Mat to = pair.right.colRange(0, size.width - shift);
    to += pair.left.colRange(shift, size.width) * 0.9;
    return pair;
}

inline Pair constant(cv::Size size, int left, int right)
{
    return {"constant", cv::Mat(size, CV_8U, cv::Scalar(left)),
            cv::Mat(size, CV_8U, cv::Scalar(right))};
}

inline std::vector<Pair> scenes()
{
    std::vector<cv::String> lefts;
    std::vector<Pair> pairs;
    cv::glob(std::string(STEREOSOT_SCENES) + "/*left*.png", lefts, true);
    for (const auto &path : lefts) {
        std::string right = path;
        right.replace(right.rfind("left"), 4, "right");
        pairs.push_back({"scene " + path.substr(path.rfind("scenes/") + 7),
                         read_picture(path, cv::IMREAD_GRAYSCALE),
                         read_picture(right, cv::IMREAD_GRAYSCALE)});
    }
    if (pairs.empty()) {
        std::fprintf(stderr, "no scenes in %s\n", STEREOSOT_SCENES);
        std::exit(1);
    }
    return pairs;
}

inline dense_eye_t eye_of(const cv::Mat &grey)
{
    return {{grey.data, nullptr, nullptr},
            static_cast<uint16_t>(grey.cols),
            static_cast<uint16_t>(grey.rows),
            static_cast<uint16_t>(grey.step)};
}

#endif
