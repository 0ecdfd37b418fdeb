//! The live map and the screen of a door on a phone, with names as long as a site may have them; and that the check finds a
//! page one pixel too wide.

mod chromium;
mod described;
mod door_fixture;
mod http_client;

use door_fixture::DoorServer;

/// Everything a site may have, under names that no line has room for, with and without places to break them.
const MORE: &str = "
[[zone]]
name = \"Vorratskellertreppenhausabsatzgarderobe\"
polygon = [[-4, -4], [-2, -4], [-2, -2], [-4, -2]]
count = true

[[zone]]
name = \"the long room between the kitchen and the garden in the north\"
polygon = [[2, -4], [4, -4], [4, -2], [2, -2]]
count = true

[[wall]]
points = [[-4, -4], [4, -4]]

[[entry]]
name = \"Vorratskellertreppenhausabsatztuer\"
line = [[-4, -4], [-4, -2]]

[[mover]]
name = \"Vorratskellertreppenhausabsatzvorhang\"
polygon = [[-4, -2], [-3, -2], [-3, -1.8], [-4, -1.8]]

[[module]]
name = \"Vorratskellertreppenhausabsatzbeleuchtung\"
x = 0.0
y = 3.0
yaw_deg = 45.0

[[door]]
name = \"Vorratskellertreppenhausabsatzgarderobentuer\"
zone = \"area\"
line = [[0.5, 1.0], [0.9, 1.0]]
fail = \"secure\"
";

/// A page whose only element has a width.
fn page_as_wide_as(width: u32) -> String {
    format!(
        "data:text/html,<!doctype html><meta name=viewport content=\"width=device-width\">\
         <body style=\"margin:0\"><div style=\"width:{width}px\">x</div>"
    )
}

#[test]
fn a_page_one_pixel_too_wide_is_found() {
    let Some(mut page) = chromium::start() else { return };
    page.phone();
    for (width, fits) in [(360, true), (361, false)] {
        page.open(&page_as_wide_as(width));
        page.wait("the page is open", &format!("document.querySelector('div').offsetWidth === {width}"));
        let too_wide = page.too_wide();
        assert_eq!(too_wide.is_empty(), fits, "{width} px: {too_wide:?}");
    }
}

#[test]
fn long_names_fit_a_phone() {
    let Some(mut page) = chromium::start() else { return };
    let server = DoorServer::of(&format!("{}{MORE}", door_fixture::SITE));
    server.people(&[[0.0, 0.4]]);
    page.size(1280, 800, 1);
    let address = server.server.address();
    page.open(&format!("http://{address}/"));
    page.wait("a person is on the map", "document.querySelectorAll('#map .person.confirmed').length === 1");
    page.fits_a_phone("map with long names");
    // Alarms and doors stand above the modules.
    page.value("document.querySelector('#modules .module-row').scrollIntoView({ block: 'center' })");
    page.click("#modules .module-row");
    page.wait("the details are open", "!document.querySelector('#detail').hidden");
    page.fits_a_phone("module with a long name");
    page.click("#edit-open");
    page.wait("the tools are there", "!document.querySelector('#tools').hidden");
    for kind in ["zone", "wall", "entry", "mover", "door", "module"] {
        page.click(&format!("#tool-{kind}"));
        page.fits_a_phone(&format!("drawing a {kind}"));
        page.click("#tool-select");
        page.value(&format!("document.querySelector('.shape[data-kind={kind}]').focus()"));
        page.wait("its form is open", "document.querySelector('#remove') !== null");
        page.fits_a_phone(&format!("form of a {kind}"));
    }
    page.click("#cancel");
    page.click("#calibrate-open");
    page.wait("the view is open", "document.body.classList.contains('calibrating')");
    page.fits_a_phone("calibration without modules");
    page.click("#calibrate-stop");
    page.open(&format!("http://{address}/door/Vorratskellertreppenhausabsatzgarderobentuer"));
    page.wait("the door is shown", "document.querySelector('#name').textContent.startsWith('Vorrat')");
    page.fits_a_phone("door with a long name");
    page.open(&format!("http://{address}/door/no-such-door"));
    page.wait("there is no such door", "document.body.dataset.phase === 'lost'");
    page.fits_a_phone("door that does not exist");
    assert_eq!(page.errors, Vec::<String>::new());
}

/// A module and an entry where the name of the zone would stand.
const COVERED: &str = "
[[entry]]
name = \"street\"
line = [[-0.9, -1.0], [0.9, -1.0]]
zone = \"area\"
";

/// Whether the shown name of the zone covers one of what a selector finds.
const COVERS: &str = "(() => {
    const own = document.querySelector('.names .zone-name').getBoundingClientRect();
    return [...document.querySelectorAll('.module .box, .module-name, .entry-name, .door .plate, .door text')].filter((other) => {
        const { left, right, top, bottom } = other.getBoundingClientRect();
        return own.left < right && left < own.right && own.top < bottom && top < own.bottom;
    }).map((other) => other.getAttribute('class') + other.textContent).join();
})()";

#[test]
fn a_zone_s_name_is_read_where_people_stand_and_covers_no_other_name() {
    let Some(mut page) = chromium::start() else { return };
    let server = DoorServer::of(&format!("{}{COVERED}", door_fixture::SITE));
    page.size(1280, 800, 1);
    page.open(&format!("http://{}/", server.server.address()));
    page.wait(
        "the zone is counted",
        "document.querySelector('.names .zone-name')?.textContent === 'area · 0'",
    );
    page.wait("all names are there", "document.querySelectorAll('.module-name, .entry-name').length === 2");
    assert_eq!(page.value(COVERS), "");
    let name = "document.querySelector('.names .zone-name')";
    let place = page.value(&format!(
        "(() => {{ const {{ left, right, top, bottom }} = {name}.getBoundingClientRect(); \
         const at = new DOMPoint((left + right) / 2, (top + bottom) / 2); \
         window.middle = at; const site = at.matrixTransform(document.querySelector('#map').getScreenCTM().inverse()); \
         return [site.x, -site.y]; }})()"
    ));
    let under = "document.elementFromPoint(middle.x, middle.y)";
    assert_eq!(
        page.value(&format!("{under}.dataset.zone")),
        "area",
        "without a person there a click is for the name"
    );
    server.people(&[[0, 1].map(|axis| place[axis].as_f64().unwrap())]);
    page.wait("a person stands there", &format!("{under}.closest('[data-person]') !== null"));
    page.wait("and is counted", &format!("{name}.textContent === 'area · 1'"));
    // Written over the person, and at the same place.
    let over = format!(
        "Boolean(document.querySelector('[data-person]').compareDocumentPosition({name}) & Node.DOCUMENT_POSITION_FOLLOWING)"
    );
    assert_eq!(page.value(&over), true);
    let stroke = format!("getComputedStyle({name}).paintOrder + getComputedStyle({name}).opacity");
    assert_eq!(page.value(&stroke), "stroke1");
    assert_eq!(page.value(COVERS), "");
    page.picture(&std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("labels.png"));
    assert_eq!(page.errors, Vec::<String>::new());
}
