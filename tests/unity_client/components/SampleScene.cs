// Loads the sample's scene, which pytest passes as lines, presses Play, and moves the mouse.
using System;
using System.Collections.Generic;
using System.Globalization;
using System.Reflection;
using System.Threading;
using HapticVLM;
using UnityEngine;

public static class SampleScene
{
    static readonly List<GameObject> Things = new List<GameObject>();

    public static void Play(string url, string samples)
    {
        Load(Assembly.LoadFrom(samples));
        foreach (GameObject thing in Things) thing.SetActive(true);
        HapticClient.Active.Connect(url); // the scene's own address is the service's usual one
        for (int i = 0; i < 4; i++) Visit(new Vector3(0.4f * i - 0.6f, 1.2f, 0f));
        foreach (string line in Debug.Lines) Components.Say(line);
        Components.Say("exceptions " + Debug.Exceptions);
        HapticClient.AbortActive();
        Components.EndOfThreads();
    }

    static void Load(Assembly samples)
    {
        GameObject thing = null;
        Component part = null;
        for (string line = Console.In.ReadLine(); line != null; line = Console.In.ReadLine())
        {
            string[] words = line.Split('\t');
            if (words[0] == "thing") thing = Make(words);
            else if (words[0] == "part") part = Add(thing, words[1], samples);
            else Set(part, words[1], words[2]);
        }
    }

    static GameObject Make(string[] words)
    {
        var thing = new GameObject(words[1]) { tag = words[2] };
        thing.SetActive(false);
        thing.transform.position = new Vector3(Number(words[3]), Number(words[4]), Number(words[5]));
        float scale = Number(words[6]);
        thing.transform.localScale = new Vector3(scale, scale, scale);
        Things.Add(thing);
        return thing;
    }

    static Component Add(GameObject thing, string name, Assembly samples)
    {
        Type type = typeof(HapticClient).Assembly.GetType("HapticVLM." + name) ?? samples.GetType("HapticVLM.Samples." + name)
            ?? typeof(GameObject).Assembly.GetType("UnityEngine." + name);
        if (type == null) return null; // a light, a listener
        var part = (Component)typeof(GameObject).GetMethod("AddComponent").MakeGenericMethod(type).Invoke(thing, null);
        var collider = part as Collider;
        if (collider != null) Physics.World.Add(collider);
        if (part is SphereCollider) Contacts.Triggers.Add(collider);
        return part;
    }

    static void Set(Component part, string name, string value)
    {
        if (part == null) return;
        if (name == "m_IsTrigger") ((Collider)part).isTrigger = value == "1";
        else if (name == "m_IsKinematic") ((Rigidbody)part).isKinematic = value == "1";
        else if (!name.StartsWith("m_") && part is MonoBehaviour) SetField(part, name, value);
    }

    static void SetField(Component part, string name, string value)
    {
        FieldInfo field = part.GetType().GetField(name, BindingFlags.Instance | BindingFlags.NonPublic);
        object converted = field.FieldType.IsEnum ? Enum.ToObject(field.FieldType, int.Parse(value)) : Convert.ChangeType(value, field.FieldType, CultureInfo.InvariantCulture);
        field.SetValue(part, converted);
    }

    static float Number(string text)
    {
        return float.Parse(text, CultureInfo.InvariantCulture);
    }

    // Points at an object, presses, waits until the screen shows the decision, and releases.
    static void Visit(Vector3 at)
    {
        Vector3 seen = at - Camera.main.transform.position;
        float x = 0.5f * Screen.width + seen.x * Screen.PixelsPerMetre, y = 0.5f * Screen.height - seen.y * Screen.PixelsPerMetre;
        Event.current.mousePosition = new Vector2(x, y);
        Turn(EventType.Repaint, 150);
        Turn(EventType.MouseDown, 1);
        double until = Clock.Now + 20.0;
        while (!GUILayout.Labels.Exists(line => line.Contains(", by ")) && Clock.Now < until) Turn(EventType.Repaint, 1);
        Components.Say("screen " + GUILayout.Labels[GUILayout.Labels.Count - 1]);
        Turn(EventType.MouseUp, 1);
        Turn(EventType.Repaint, 40);
    }

    static void Turn(EventType type, int frames)
    {
        Event.current.type = type;
        for (int i = 0; i < frames; i++)
        {
            Player.Tick();
            Player.DrawGui();
            Thread.Sleep(2);
        }
    }
}
