// A server by the C++ library OpenIGTLink: PORT FRAMES TRIANGLES KIND. Standard input has the triangles as big-endian u32,
// and the frames as big-endian f32. For TRANSFORM, TDATA and QTDATA a tool's pose comes before each, and the answers are
// printed.

#include <array>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <thread>
#include <vector>

#include <igtlNDArrayMessage.h>
#include <igtlPointMessage.h>
#include <igtlPolyDataMessage.h>
#include <igtlQuaternionTrackingDataMessage.h>
#include <igtlServerSocket.h>
#include <igtlStringMessage.h>
#include <igtlTrackingDataMessage.h>
#include <igtlTransformMessage.h>

using Point = std::array<float, 3>;
using Face = std::array<igtlUint32, 3>;

static std::vector<std::uint32_t> words() {
    std::vector<std::uint32_t> found;
    unsigned char bytes[4];
    while (std::fread(bytes, 1, 4, stdin) == 4) {
        found.push_back(std::uint32_t(bytes[0]) << 24 | bytes[1] << 16 | bytes[2] << 8 | bytes[3]);
    }
    return found;
}

static igtl::MessageBase::Pointer poly_data(std::vector<Point> &points, std::vector<Face> &faces) {
    auto message = igtl::PolyDataMessage::New();
    auto vertices = igtl::PolyDataPointArray::New();
    for (Point &point : points) {
        vertices->AddPoint(point.data());
    }
    auto polygons = igtl::PolyDataCellArray::New();
    for (Face &face : faces) {
        polygons->AddCell(3, face.data());
    }
    message->SetPoints(vertices);
    message->SetPolygons(polygons);
    return message.GetPointer();
}

static igtl::MessageBase::Pointer point_list(const std::vector<Point> &points) {
    auto message = igtl::PointMessage::New();
    for (const Point &point : points) {
        auto element = igtl::PointElement::New();
        element->SetPosition(point[0], point[1], point[2]);
        message->AddPointElement(element);
    }
    return message.GetPointer();
}

static igtl::MessageBase::Pointer nd_array(const std::vector<Point> &points) {
    auto message = igtl::NDArrayMessage::New();
    // Never freed: the message refers to it, and the program ends soon.
    auto *array = new igtl::Array<igtlFloat32>;
    array->SetSize({igtlUint16(points.size()), 3});
    std::memcpy(array->GetRawArray(), points.data(), array->GetRawArraySize());
    message->SetArray(igtl::NDArrayMessage::TYPE_FLOAT32, array);
    return message.GetPointer();
}

// The tool's pose: half a turn about z, and a shift. None for another kind.
static igtl::MessageBase::Pointer pose(const std::string &kind) {
    igtl::Matrix4x4 matrix = {{-1, 0, 0, 100}, {0, -1, 0, -20}, {0, 0, 1, 30}, {0, 0, 0, 1}};
    if (kind == "TRANSFORM") {
        auto message = igtl::TransformMessage::New();
        message->SetDeviceName("pointer");
        message->SetMatrix(matrix);
        return message.GetPointer();
    }
    if (kind == "TDATA") {
        auto message = igtl::TrackingDataMessage::New();
        auto element = igtl::TrackingDataElement::New();
        element->SetName("pointer");
        element->SetType(igtl::TrackingDataElement::TYPE_TRACKER);
        element->SetMatrix(matrix);
        message->SetDeviceName("tracker");
        message->AddTrackingDataElement(element);
        return message.GetPointer();
    }
    if (kind == "QTDATA") {
        auto message = igtl::QuaternionTrackingDataMessage::New();
        auto element = igtl::QuaternionTrackingDataElement::New();
        element->SetName("pointer");
        element->SetType(igtl::QuaternionTrackingDataElement::TYPE_TRACKER);
        element->SetPosition(100, -20, 30);
        element->SetQuaternion(0, 0, 1, 0);
        message->SetDeviceName("tracker");
        message->AddQuaternionTrackingDataElement(element);
        return message.GetPointer();
    }
    return nullptr;
}

static bool receive(igtl::Socket *peer, void *to, int size) {
    return size == 0 || peer->Receive(to, size) == size;
}

// The next STRING; null where the peer is gone.
static igtl::StringMessage::Pointer answer(igtl::Socket *peer) {
    for (;;) {
        auto header = igtl::MessageHeader::New();
        header->InitPack();
        if (!receive(peer, header->GetPackPointer(), header->GetPackSize())) {
            return nullptr;
        }
        header->Unpack();
        if (std::strcmp(header->GetDeviceType(), "STRING") != 0) {
            peer->Skip(header->GetBodySizeToRead());
            continue;
        }
        auto message = igtl::StringMessage::New();
        message->SetMessageHeader(header);
        message->AllocatePack();
        if (!receive(peer, message->GetPackBodyPointer(), message->GetPackBodySize())) {
            return nullptr;
        }
        return (message->Unpack(1) & igtl::MessageHeader::UNPACK_BODY) != 0 ? message : nullptr;
    }
}

static bool send(igtl::Socket *peer, igtl::MessageBase *message) {
    auto now = igtl::TimeStamp::New();
    now->GetTime();
    message->SetTimeStamp(now);
    message->Pack();
    return peer->Send(message->GetPackPointer(), message->GetPackSize()) != 0;
}

int main(int, char **arguments) {
    const int port = std::atoi(arguments[1]), frames = std::atoi(arguments[2]);
    const std::size_t triangles = std::atoi(arguments[3]);
    const std::string kind = arguments[4];
    const std::vector<std::uint32_t> data = words();
    std::vector<Face> faces(triangles);
    std::memcpy(faces.data(), data.data(), sizeof(Face) * triangles);
    const std::size_t vertices = (data.size() - 3 * triangles) / 3 / frames;

    auto server = igtl::ServerSocket::New();
    if (server->CreateServer(port) < 0) {
        return 1;
    }
    const igtl::Socket::Pointer peer = server->WaitForConnection(60'000).GetPointer();
    if (peer.IsNull()) {
        return 2;
    }
    for (int frame = 0; frame < frames; ++frame) {
        std::vector<Point> points(vertices);
        std::memcpy(points.data(), &data[3 * (triangles + frame * vertices)], sizeof(Point) * vertices);
        igtl::MessageBase::Pointer tool = pose(kind);
        if (tool.IsNotNull()) {
            if (!send(peer, tool)) {
                return 4;
            }
            auto said = answer(peer);
            if (said.IsNull()) {
                return 5;
            }
            std::printf("%s\n", said->GetString());
            std::fflush(stdout);
        }
        igtl::MessageBase::Pointer message = kind == "POINT"     ? point_list(points)
                                           : kind == "NDARRAY" ? nd_array(points)
                                                               : poly_data(points, faces);
        message->SetDeviceName("heart");
        if (!send(peer, message)) {
            return 3;
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    std::this_thread::sleep_for(std::chrono::seconds(60));
}
