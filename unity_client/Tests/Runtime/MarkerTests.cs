using System;
using System.Collections;
using HapticVLM.Wire;
using NUnit.Framework;
using UnityEngine;
using UnityEngine.TestTools;
using Object = UnityEngine.Object;

namespace HapticVLM.Tests
{
    // Checks that pictures are upright with this graphics API and pipeline: red above, blue below.
    public class MarkerTests
    {
        const int Side = 128;
        const double WaitS = 10.0;

        [UnityTest]
        public IEnumerator ThePictureOfAViewIsUpright()
        {
            GameObject red = Cube(new Vector3(0f, 1.2f, 5f), new Color(1f, 0f, 0f, 1f));
            GameObject blue = Cube(new Vector3(0f, -1.2f, 5f), new Color(0f, 0f, 1f, 1f));
            var to = new HapticConnection(new ConnectionSettings());
            var pipe = new FramePipe(Side, Side, 90);
            var capture = new CaptureCamera(pipe.Target);
            capture.Draw();
            pipe.Take(new Shot { To = to, CapturedAt = Clock.Now });
            double until = Clock.Now + WaitS;
            while (!to.Outbox.Frames.IsFull && Clock.Now < until) yield return null;
            Assert.IsTrue(to.Outbox.Frames.IsFull, "no picture came back from the GPU");
            AssertUpright(to.Outbox.Frames.Take());
            pipe.Retire();
            capture.Destroy();
            Object.Destroy(red);
            Object.Destroy(blue);
            yield return null;
        }

        static void AssertUpright(MsgPackWriter message)
        {
            var reader = new MsgPackReader(message.Written);
            Frame frame = Frame.Read(ref reader, new StringPool());
            Assert.AreEqual(FrameOrigin.Top, frame.Origin);
            var jpeg = new byte[frame.Image.Count];
            Array.Copy(frame.Image.Array, frame.Image.Offset, jpeg, 0, jpeg.Length);
            var picture = new Texture2D(2, 2);
            Assert.IsTrue(ImageConversion.LoadImage(picture, jpeg));
            Color above = picture.GetPixel(picture.width / 2, picture.height * 5 / 8);
            Color below = picture.GetPixel(picture.width / 2, picture.height * 3 / 8);
            Assert.Greater(above.r, above.b + 0.02f, "the upper cube is not red: the picture is upside down");
            Assert.Greater(below.b, below.r + 0.02f, "the lower cube is not blue: the picture is upside down");
        }

        static GameObject Cube(Vector3 at, Color color)
        {
            GameObject cube = GameObject.CreatePrimitive(PrimitiveType.Cube);
            cube.transform.position = at;
            cube.transform.localScale = new Vector3(2f, 2f, 2f);
            cube.GetComponent<Renderer>().material.color = color;
            return cube;
        }
    }
}
