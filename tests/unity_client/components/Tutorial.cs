// Follows the steps of the Unity tutorial, which pytest passes as lines, in a project's first scene.
using System;
using System.Threading;
using HapticVLM;
using UnityEngine;

public static class Tutorial
{
    static GameObject camera;

    public static void Follow(string url)
    {
        Application.isPlaying = false;
        camera = new GameObject("Main Camera") { tag = "MainCamera" };
        camera.AddComponent<Camera>();
        camera.transform.position = new Vector3(0f, 1f, -10f); // as in the editor's 3D template
        for (string line = Console.In.ReadLine(); line != null; line = Console.In.ReadLine())
        {
            string[] words = line.Split('\t');
            if (words[0] == "menu" && words[1].EndsWith("Cube")) GameObject.CreatePrimitive(PrimitiveType.Cube);
            else if (words[0] == "menu") EditMode.Invoke(words[1]);
            else if (words[0] == "name") GameObject.Scene[GameObject.Scene.Count - 1].name = words[1];
            else if (words[0] == "onto camera") AddMouseHandToCamera();
            else if (words[0] == "play") Play(url);
        }
        Components.Say("exceptions " + Debug.Exceptions);
        HapticClient.AbortActive();
    }

    static void AddMouseHandToCamera()
    {
        camera.AddComponent<HapticHand>(); // required by the next one
        camera.AddComponent<MouseHand>();
    }

    static void Play(string url)
    {
        foreach (GameObject thing in GameObject.Scene)
        {
            var ball = thing.GetComponent<SphereCollider>();
            if (ball != null) Contacts.Triggers.Add(ball);
        }
        Player.PressPlay();
        HapticClient.Active.Connect(url); // the scene's own address is the service's usual one
        MouseHand hand = GameObject.Scene.Find(thing => thing.GetComponent<MouseHand>() != null).GetComponent<MouseHand>();
        Input.mousePosition = Centre();
        Turn(150);
        Components.Say("hovers at " + At(hand.transform));
        Input.IsDown = true;
        double until = Clock.Now + (hand.isActiveAndEnabled ? 20.0 : 0.0);
        while (!GUILayout.Labels.Exists(line => line.Contains(", by ")) && Clock.Now < until) Turn(1);
        Turn(40);
        Components.Say("touches at " + At(hand.transform));
        Components.Say("screen " + string.Join(" | ", GUILayout.Labels.ToArray()));
        Input.IsDown = false;
        Turn(40);
        Components.Say("camera at " + At(camera.transform));
    }

    // The pixel at which the camera sees the cube.
    static Vector3 Centre()
    {
        Vector3 seen = new Vector3(0f, 0f, 0f) - camera.transform.position;
        return new Vector3(0.5f * Screen.width + seen.x * Screen.PixelsPerMetre, 0.5f * Screen.height + seen.y * Screen.PixelsPerMetre, 0f);
    }

    static string At(Transform place)
    {
        Vector3 at = place.position;
        return string.Format(System.Globalization.CultureInfo.InvariantCulture, "{0:f2} {1:f2} {2:f2}", at.x, at.y, at.z);
    }

    static void Turn(int frames)
    {
        for (int i = 0; i < frames; i++)
        {
            Player.Tick();
            Player.DrawGui();
            Thread.Sleep(2);
        }
    }
}
